//! Asking the device: queues that are large enough, and what comes back.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use vertebra_gpu::{Buffer, Output, Timing};
use vertebra_shaders::collision::{Answer, COUNTERS, Job, RECORD, Sizes};

use super::collider::{Resident, count};
use super::error::Error;
use super::ready::Ready;
use super::room::{Counts, ENTRY, Room};
use super::settle::Record;

/// Pairs of nodes that one run may look at, all against all: their counters are words.
const MOST_NODE_PAIRS: u64 = 1 << 31;

/// What is asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Ask {
    pub(super) answer: Kind,
    /// Whether all pairs that meet come as records.
    pub(super) leaves_hits: bool,
    /// Words of an answer for a job, and of the part of it that is about A.
    pub(super) words: [u32; 2],
    /// Rows of the matrix.
    pub(super) rows: u32,
    /// How pairs are found.
    pub(super) way: Way,
    /// Whether both meshes are one.
    pub(super) itself: bool,
}

/// How pairs are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Way {
    /// The nodes of a level all against all, then down both trees; level 0 is the blocks.
    Blocks {
        /// The level that is begun with.
        level: u32,
    },
    /// Triangles all against all, by the test of Möller with a tolerance of these bits.
    Moller(u32),
}

/// The answers of kernels, as keys.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Kind {
    Any,
    Count,
    Mask,
    Pairs,
    Matrix,
}

impl Kind {
    pub(super) fn answer(self) -> Answer {
        match self {
            Self::Any => Answer::Any,
            Self::Count => Answer::Count,
            Self::Mask => Answer::Mask,
            Self::Pairs => Answer::Pairs,
            Self::Matrix => Answer::Matrix,
        }
    }
}

/// What the device found for some jobs in a row.
#[derive(Debug, Default)]
pub(super) struct Found {
    /// Of all jobs asked about, the first that this is about.
    pub(super) first_job: usize,
    /// The answer: a word a job, or bits, or three words a pair with the job from the first.
    pub(super) words: Vec<u32>,
    /// Whether a list is in lexicographic order.
    pub(super) sorted: bool,
    /// Pairs that are left to the host, with the job from the first.
    pub(super) records: Vec<Record>,
    /// Pairs that single precision left undecided.
    pub(super) undecided: u64,
    /// Pairs of blocks whose boxes overlap.
    pub(super) block_pairs: u64,
    /// The poses of bodies, where they came from a buffer.
    pub(super) poses: Vec<f32>,
    /// Time on the device \[s].
    pub(super) gpu_time: Option<f64>,
}

/// A search prepared for two meshes.
#[derive(Debug)]
pub(super) struct Search {
    pub(super) a: Arc<Resident>,
    pub(super) b: Arc<Resident>,
    /// Where bodies stand, if that comes from a buffer.
    pub(super) poses: Option<Buffer<f32>>,
    ready: Mutex<HashMap<Ask, Ready>>,
}

impl Search {
    /// Of meshes on one device.
    pub(super) fn new(a: &Arc<Resident>, b: &Arc<Resident>) -> Result<Self, Error> {
        if !a.device.is(&b.device) {
            return Err(Error::OtherDevice);
        }
        Ok(Self::of(a, b))
    }

    pub(super) fn of(a: &Arc<Resident>, b: &Arc<Resident>) -> Self {
        Self {
            a: Arc::clone(a),
            b: Arc::clone(b),
            poses: None,
            ready: Mutex::default(),
        }
    }

    /// The same, with poses from a buffer.
    pub(super) fn placed(&self, poses: &Buffer<f32>) -> Self {
        Self {
            poses: Some(poses.clone()),
            ..Self::of(&self.a, &self.b)
        }
    }

    /// Asks about all jobs; more than one part only if the queues for all at once do not fit on the device.
    pub(super) fn ask(
        &self,
        ask: Ask,
        (row, timing): (u32, Timing),
        jobs: &[Job],
    ) -> Result<Vec<Found>, Error> {
        let mut parts = Vec::new();
        if jobs.is_empty() {
            return Ok(parts);
        }
        let mut ready = self.ready.lock().unwrap_or_else(PoisonError::into_inner);
        // Parts still to be asked about, the next last.
        let mut left = vec![(0, jobs.to_vec())];
        while let Some((first_job, jobs)) = left.pop() {
            if ask.way.node_pairs(&jobs) > MOST_NODE_PAIRS {
                left.extend(halves(first_job, &jobs));
                continue;
            }
            match self.ask_once(&mut ready, ask, (row, timing), &jobs)? {
                Some(found) => parts.push(Found { first_job, ..found }),
                None => left.extend(halves(first_job, &jobs)),
            }
        }
        self.a.check()?;
        self.b.check()?;
        Ok(parts)
    }

    /// None if the queues would exceed what a kernel can be given.
    fn ask_once(
        &self,
        ready: &mut HashMap<Ask, Ready>,
        ask: Ask,
        (row, timing): (u32, Timing),
        jobs: &[Job],
    ) -> Result<Option<Found>, Error> {
        let (jobs, sizes) = self.numbered(jobs, ask.way);
        let most = Room::most(&self.a.device.limits());
        let meshes = [self.a.as_ref(), self.b.as_ref()];
        let mut room = Room::guess(sizes.jobs, sizes.groups, meshes, &most);
        loop {
            let current = ready.get(&ask).map(|ready| ready.room);
            let wanted = current.map_or(room, |current| current.union(room));
            if current != Some(wanted) {
                // The old buffers are given back first.
                ready.remove(&ask);
                ready.insert(ask, Ready::new(self, ask, wanted)?);
            }
            let Some(prepared) = ready.get_mut(&ask) else {
                return Ok(None);
            };
            let output = prepared.run(ask, (row, timing), (&jobs, sizes))?;
            let words: Vec<u32> = output.read(prepared.found)?;
            let Some(counts) = Counts::of(&words) else {
                return Ok(None);
            };
            let lists = ask.answer == Kind::Pairs;
            if wanted.holds(&counts, lists) {
                let used = if lists {
                    ENTRY * counts.hits as usize
                } else {
                    words.len() - COUNTERS
                };
                let answer = words[COUNTERS..][..used].to_vec();
                return Ok(Some(Found::read(prepared, &output, &counts, answer)?));
            }
            if !most.holds(&counts, lists) {
                return Ok(None);
            }
            room = wanted.grown(&counts, lists, &most);
        }
    }

    /// The jobs with the workgroups they begin at, and how many there are of both.
    fn numbered(&self, jobs: &[Job], way: Way) -> (Vec<Job>, Sizes) {
        let mut groups = 0_u32;
        let number = |job: &Job| {
            let first_group = groups;
            groups = groups.saturating_add(way.groups(job));
            Job {
                first_group,
                ..*job
            }
        };
        let jobs: Vec<_> = jobs.iter().map(number).collect();
        let level = match way {
            Way::Blocks { level } => level,
            Way::Moller(_) => 0,
        };
        let sizes = Sizes {
            jobs: count(jobs.len()),
            groups,
            level,
            a_at: self.a.level_at(level),
            b_at: self.b.level_at(level),
            ..Sizes::default()
        };
        (jobs, sizes)
    }
}

impl Found {
    /// What a run found that had room for everything, of which the answer is read.
    fn read(
        ready: &Ready,
        output: &Output,
        counts: &Counts,
        words: Vec<u32>,
    ) -> Result<Self, vertebra_gpu::Error> {
        let left = if ready.settles {
            counts.left
        } else {
            counts.undecided
        };
        let records: Vec<u32> = output.read(ready.records)?;
        let records = Record::list(&records[..RECORD * left as usize]).collect();
        let poses = ready.poses.map(|poses| output.read(poses));
        Ok(Self {
            first_job: 0,
            words,
            sorted: ready.sorts,
            records,
            undecided: counts.undecided.into(),
            block_pairs: counts.blocks.into(),
            poses: poses.transpose()?.unwrap_or_default(),
            gpu_time: output.gpu_time(),
        })
    }
}

/// Two halves, the first last: of the jobs, or of the longer row of blocks if there is only one.
fn halves(first_job: usize, jobs: &[Job]) -> [(usize, Vec<Job>); 2] {
    if let [job] = jobs {
        let (mut front, mut back) = (*job, *job);
        if job.b_blocks >= job.a_blocks {
            front.b_blocks /= 2;
            back.b_first += front.b_blocks;
            back.b_blocks -= front.b_blocks;
        } else {
            front.a_blocks /= 2;
            back.a_first += front.a_blocks;
            back.a_blocks -= front.a_blocks;
        }
        return [(first_job, vec![back]), (first_job, vec![front])];
    }
    let (front, back) = jobs.split_at(jobs.len() / 2);
    [
        (first_job + front.len(), back.to_vec()),
        (first_job, front.to_vec()),
    ]
}
