//! Asking the device: queues that are large enough, and what comes back.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use vertebra_gpu::{Buffer, Device, Program, Recording, Shared, Slot, Timing, workgroups};
use vertebra_shaders::collision::{
    Answer, BLOCK_PAIRS, Bodies, Job, MOLLER_TILE, PAIRS_A_ROUND, PLACE_BODIES, Places, RECORD,
    Sizes, TILE, TREE_PAIRS, Tolerance, WIDTH, moller, narrow,
};

use super::collider::Resident;
use super::error::Error;
use super::settle::Record;

/// Workgroups of the narrow phase; each takes its share of the queue.
const NARROW_GROUPS: u32 = 2048;

/// Words of an entry of the queue, and of a hit.
const ENTRY: usize = 3;

/// Pairs of blocks that one run may look at, all against all.
const MOST_BLOCK_PAIRS: u64 = 1 << 31;

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
    /// Blocks all against all.
    AllPairs,
    /// Down the tree of A.
    Tree,
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
    fn answer(self) -> Answer {
        match self {
            Self::Any => Answer::Any,
            Self::Count => Answer::Count,
            Self::Mask => Answer::Mask,
            Self::Pairs => Answer::Pairs,
            Self::Matrix => Answer::Matrix,
        }
    }
}

/// Room for a search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Room {
    jobs: u32,
    groups: u32,
    queue: u32,
    hits: u32,
    undecided: u32,
}

impl Room {
    /// What holds both.
    fn union(self, other: Self) -> Self {
        Self {
            jobs: self.jobs.max(other.jobs),
            groups: self.groups.max(other.groups),
            queue: self.queue.max(other.queue),
            hits: self.hits.max(other.hits),
            undecided: self.undecided.max(other.undecided),
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
    /// Undecided pairs, with the job from the first.
    pub(super) records: Vec<Record>,
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
    poses: Option<Buffer<f32>>,
    ready: Mutex<HashMap<Ask, Ready>>,
}

/// A program and its slots.
#[derive(Debug)]
struct Ready {
    program: Program,
    room: Room,
    timing: Timing,
    sizes: Slot<Sizes>,
    places: Slot<Places>,
    jobs: Slot<Job>,
    counts: Slot<u32>,
    found: Slot<u32>,
    poses: Option<Slot<f32>>,
    /// What was last written to the slots.
    written: (Vec<Job>, Sizes, Places),
    /// Words of the answer in `found`; undecided pairs follow.
    answer_words: usize,
}

/// The buffers of a mesh in a recording.
#[derive(Clone, Copy)]
struct Slots {
    vertices: Slot<f32>,
    leaves: Slot<[u32; 4]>,
    boxes: Slot<[f32; 4]>,
}

impl Slots {
    fn of(recording: &mut Recording, name: &str, mesh: &Resident) -> Self {
        recording.scope(name, |recording| Self {
            vertices: recording.shared("vertices", mesh.vertices.len()),
            leaves: recording.shared("leaves", mesh.leaves.len()),
            boxes: recording.shared("boxes", mesh.boxes.len()),
        })
    }

    fn are(&self, mesh: &Resident) -> [Shared; 3] {
        [
            self.vertices.is(&mesh.vertices),
            self.leaves.is(&mesh.leaves),
            self.boxes.is(&mesh.boxes),
        ]
    }
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
            // Counters are words.
            if pairs_of_blocks(&jobs) > MOST_BLOCK_PAIRS && ask.way != Way::Tree {
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
        let (jobs, groups) = numbered(jobs, ask.way);
        let mut room = Room {
            jobs: count(jobs.len()),
            groups,
            queue: self.first_queue(),
            hits: 2048,
            undecided: 256,
        };
        let most = self.most();
        loop {
            let current = ready.get(&ask).map(|ready| ready.room);
            let wanted = current.map_or(room, |current| current.union(room));
            if current != Some(wanted) {
                // The old buffers are given back first.
                ready.remove(&ask);
                ready.insert(ask, self.prepare(ask, wanted)?);
            }
            let Some(prepared) = ready.get_mut(&ask) else {
                return Ok(None);
            };
            if prepared.timing != timing {
                prepared.program.take_times(timing)?;
                prepared.timing = timing;
            }
            let output = self.run(prepared, ask, row, &jobs, groups)?;
            let counts: Vec<u32> = output.read(prepared.counts)?;
            let [queued, hits, undecided, ..] = counts[..] else {
                return Ok(None);
            };
            let wanted = prepared.room;
            let lists = ask.answer == Kind::Pairs;
            let fits = queued <= wanted.queue
                && undecided <= wanted.undecided
                && (!lists || hits <= wanted.hits);
            if fits {
                let mut words: Vec<u32> = output.read(prepared.found)?;
                let records = &words[prepared.answer_words..][..RECORD * undecided as usize];
                let records = Record::list(records).collect();
                let poses = prepared.poses.map(|poses| output.read(poses));
                let poses = poses.transpose()?.unwrap_or_default();
                let used = if lists {
                    ENTRY * hits as usize
                } else {
                    prepared.answer_words
                };
                words.truncate(used);
                return Ok(Some(Found {
                    first_job: 0,
                    words,
                    records,
                    block_pairs: queued.into(),
                    poses,
                    gpu_time: output.gpu_time(),
                }));
            }
            // More than what was counted may come once the queue is long enough.
            let grown = |needed: u32, have: u32| match needed {
                _ if needed <= have => have,
                _ => needed.max(have.saturating_mul(2)),
            };
            room = Room {
                queue: grown(queued, wanted.queue),
                hits: if lists {
                    grown(hits, wanted.hits)
                } else {
                    wanted.hits
                },
                undecided: grown(undecided, wanted.undecided),
                ..wanted
            };
            let too_long = queued > most.queue || undecided > most.undecided;
            if too_long || (lists && hits > most.hits) {
                return Ok(None);
            }
            room.queue = room.queue.min(most.queue);
            room.hits = room.hits.min(most.hits);
            room.undecided = room.undecided.min(most.undecided);
        }
    }

    fn run(
        &self,
        ready: &mut Ready,
        ask: Ask,
        row: u32,
        jobs: &[Job],
        groups: u32,
    ) -> Result<vertebra_gpu::Output, Error> {
        let Room {
            queue,
            hits,
            undecided,
            jobs: room,
            ..
        } = ready.room;
        let mut padded = jobs.to_vec();
        padded.resize(room as usize, Job::default());
        let sizes = Sizes {
            jobs: count(jobs.len()),
            groups,
            queue,
        };
        let places = Places {
            queue,
            hits,
            undecided,
            undecided_at: count(ready.answer_words),
            answer: ask.words[0],
            answer_a: ask.words[1],
            row,
            rows: ask.rows,
        };
        // What the device has from the last run is not written again.
        let written = (padded, sizes, places);
        // (Rows that come from a buffer are no matter.)
        if ready.written.0 != written.0 {
            ready.program.write(ready.jobs, &written.0)?;
        }
        if ready.written.1 != written.1 {
            ready.program.write(ready.sizes, &[written.1])?;
        }
        if ready.written.2 != written.2 {
            ready.program.write(ready.places, &[written.2])?;
        }
        ready.written = written;
        Ok(ready.program.run()?.wait()?)
    }

    fn prepare(&self, ask: Ask, room: Room) -> Result<Ready, Error> {
        let (a, b) = (&self.a, &self.b);
        let mut recording = Recording::new("collision");
        let sizes = recording.buffer("sizes", 1);
        let places = recording.buffer("places", 1);
        let jobs = recording.buffer("jobs", room.jobs as usize);
        let queue = recording.buffer::<u32>("queue", ENTRY * room.queue as usize);
        let counts = recording.buffer::<u32>("counts", 4);
        let answer_words = match ask.answer {
            Kind::Pairs => ENTRY * room.hits as usize,
            Kind::Matrix => ask.words[0] as usize * ask.rows as usize,
            Kind::Any | Kind::Count | Kind::Mask => ask.words[0] as usize * room.jobs as usize,
        };
        let found_words = answer_words + RECORD * room.undecided as usize;
        let found = recording.buffer::<u32>("found", found_words);
        // A buffer has one slot: of a mesh and itself both are one.
        let slots_a = Slots::of(&mut recording, "a", a);
        let slots_b = if Arc::ptr_eq(a, b) {
            slots_a
        } else {
            Slots::of(&mut recording, "b", b)
        };
        recording.clear(counts);
        if ask.answer != Kind::Pairs {
            recording.clear(found);
        }
        let meshes = [
            slots_a.vertices.any(),
            slots_a.leaves.any(),
            slots_b.vertices.any(),
            slots_b.leaves.any(),
        ];
        let poses = self.poses.as_ref().map(|poses| {
            let slot = recording.shared::<f32>("poses", poses.len());
            let bodies = recording.buffer_from("bodies", &[Bodies { jobs: room.jobs }]);
            let buffers = [bodies.any(), slot.any(), jobs.any()];
            recording.dispatch(&PLACE_BODIES, &buffers, workgroups(room.jobs, 64));
            (slot, slot.is(poses))
        });
        let groups = workgroups(room.groups, 1);
        if let Way::Moller(epsilon) = ask.way {
            let epsilon = f32::from_bits(epsilon);
            let tolerance = recording.buffer_from("tolerance", &[Tolerance { epsilon }]);
            let mut buffers = vec![sizes.any(), places.any(), tolerance.any(), jobs.any()];
            buffers.extend(meshes);
            buffers.extend([counts.any(), found.any()]);
            recording.dispatch(&moller(ask.answer.answer()), &buffers, groups);
        } else {
            let mut buffers = vec![
                sizes.any(),
                jobs.any(),
                slots_a.boxes.any(),
                slots_b.boxes.any(),
                queue.any(),
                counts.any(),
            ];
            let kernel = if ask.way == Way::Tree {
                buffers.push(recording.buffer_from("tree", &[a.tree()]).any());
                &TREE_PAIRS
            } else {
                &BLOCK_PAIRS
            };
            recording.dispatch(kernel, &buffers, groups);
            let kernel = narrow(ask.answer.answer(), ask.itself);
            let kernel = kernel.constant("LEAVE_HITS", u8::from(ask.leaves_hits));
            let mut buffers = vec![places.any(), jobs.any(), queue.any()];
            buffers.extend(meshes);
            buffers.extend([counts.any(), found.any()]);
            let rounds = room.queue.div_ceil(PAIRS_A_ROUND);
            recording.dispatch(&kernel, &buffers, [rounds.clamp(1, NARROW_GROUPS), 1, 1]);
        }
        recording.download(counts);
        recording.download(found);
        if let Some((slot, _)) = &poses {
            recording.download(*slot);
        }
        let mut shared = slots_a.are(a).to_vec();
        if !Arc::ptr_eq(a, b) {
            shared.extend(slots_b.are(b));
        }
        let (poses, given) = poses.unzip();
        shared.extend(given);
        let program = self.device().prepare_with(&recording, &shared)?;
        Ok(Ready {
            program,
            room,
            timing: Timing::Off,
            written: (Vec::new(), Sizes::default(), Places::default()),
            sizes,
            places,
            jobs,
            counts,
            found,
            poses,
            answer_words,
        })
    }

    fn device(&self) -> &Device {
        &self.a.device
    }

    /// A guess: of surfaces that cross, each block near the crossing meets a few.
    fn first_queue(&self) -> u32 {
        let blocks = self.a.blocks().saturating_add(self.b.blocks());
        blocks.clamp(1024, self.most().queue.max(1024))
    }

    /// The longest lists that a kernel can be given.
    fn most(&self) -> Room {
        let limits = self.device().limits();
        let bytes = limits
            .max_buffer_size
            .min(limits.max_storage_buffer_binding_size);
        // Half of it for the answer, and half for undecided pairs.
        let words = u32::try_from(bytes / 4).unwrap_or(u32::MAX);
        Room {
            jobs: u32::MAX,
            groups: u32::MAX,
            queue: (words / count(ENTRY)).min(1 << 25),
            hits: words / 2 / count(ENTRY),
            undecided: words / 2 / count(RECORD),
        }
    }
}

/// The jobs with the workgroups they begin at, and how many workgroups there are.
fn numbered(jobs: &[Job], way: Way) -> (Vec<Job>, u32) {
    let mut groups = 0_u32;
    let number = |job: &Job| {
        let first_group = groups;
        let tiles = |a: u32, b: u32| {
            job.a_blocks
                .div_ceil(a)
                .saturating_mul(job.b_blocks.div_ceil(b))
        };
        let tiles = match way {
            Way::AllPairs => tiles(TILE, TILE),
            Way::Tree => job.b_blocks.div_ceil(TILE),
            Way::Moller(_) => {
                let [a, b] = MOLLER_TILE.map(|triangles| count(triangles / WIDTH));
                tiles(a, b)
            }
        };
        groups = groups.saturating_add(tiles);
        Job {
            first_group,
            ..*job
        }
    };
    (jobs.iter().map(number).collect(), groups)
}

/// Two halves, the first last: of the jobs, or of the blocks of B if there is only one.
fn halves(first_job: usize, jobs: &[Job]) -> [(usize, Vec<Job>); 2] {
    if let [job] = jobs {
        let half = job.b_blocks / 2;
        let front = Job {
            b_blocks: half,
            ..*job
        };
        let back = Job {
            b_first: job.b_first + half,
            b_blocks: job.b_blocks - half,
            ..*job
        };
        return [(first_job, vec![back]), (first_job, vec![front])];
    }
    let (front, back) = jobs.split_at(jobs.len() / 2);
    [
        (first_job + front.len(), back.to_vec()),
        (first_job, front.to_vec()),
    ]
}

fn pairs_of_blocks(jobs: &[Job]) -> u64 {
    let pairs = |job: &Job| u64::from(job.a_blocks) * u64::from(job.b_blocks);
    jobs.iter().map(pairs).sum()
}

fn count(len: usize) -> u32 {
    u32::try_from(len).unwrap_or(u32::MAX)
}
