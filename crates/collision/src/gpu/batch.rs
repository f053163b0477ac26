//! Questions asked together: about two meshes in one or many poses, about one mesh, about many bodies.

use std::collections::BTreeMap;
use std::time::Instant;

use glam::{DQuat, DVec3};
use vertebra_gpu::Timing;
use vertebra_shaders::collision::{Job, POSE};
use vertebra_spatial::Pose;

use super::cost::way;
use super::error::Error;
use super::query::Statistics;
use super::search::{Ask, Found, Kind, Search, Way};
use super::settle::Record;
use crate::classify::classify;
use crate::culling::Culling;
use crate::curves::{Builder, Corners, Curves};
use crate::error::QueryError;
use crate::parallel;
use crate::query::ClassifiedPair;
use crate::transform::RelativePose;

/// Pairs from which on several threads look at them: for fewer, waking threads takes longer.
const MANY: usize = 512;

/// Questions about the meshes of a search, each with its pose.
#[derive(Debug)]
pub(super) struct Batch<'a> {
    search: &'a Search,
    /// The pose of each job; none if they come from a buffer.
    poses: Vec<RelativePose>,
    jobs: Vec<Job>,
    way: Way,
    itself: bool,
}

impl<'a> Batch<'a> {
    /// One job a pose, or poses from a buffer.
    pub(super) fn new(
        search: &'a Search,
        poses: Vec<RelativePose>,
        jobs: Vec<Job>,
        culling: Culling,
    ) -> Self {
        Self {
            search,
            way: way(culling, &jobs, search.a.top().min(search.b.top())),
            itself: jobs.iter().any(|job| job.itself != 0),
            poses,
            jobs,
        }
    }

    /// By the test of Möller, with this tolerance.
    pub(super) fn moller(mut self, epsilon: f32) -> Self {
        self.way = Way::Moller(epsilon.to_bits());
        self
    }

    /// Of each job, whether any two triangles meet.
    pub(super) fn any(&self) -> Result<Vec<bool>, Error> {
        let mut answers = vec![false; self.jobs.len()];
        for part in self.ask(Kind::Any, [1, 0])? {
            for (answer, word) in answers[part.first_job..].iter_mut().zip(&part.words) {
                *answer |= *word != 0;
            }
            for record in self.settled(&part)? {
                answers[part.first_job + record.job] = true;
            }
        }
        Ok(answers)
    }

    /// Of each job, how many pairs meet.
    pub(super) fn count(&self) -> Result<Vec<u64>, Error> {
        let mut answers = vec![0; self.jobs.len()];
        for part in self.ask(Kind::Count, [1, 0])? {
            for (answer, word) in answers[part.first_job..].iter_mut().zip(&part.words) {
                *answer += u64::from(*word);
            }
            for record in self.settled(&part)? {
                answers[part.first_job + record.job] += 1;
            }
        }
        Ok(answers)
    }

    /// Of the only job, which of so many triangles meet some.
    pub(super) fn mask(&self, [a, b]: [u32; 2]) -> Result<[Vec<bool>; 2], Error> {
        let words = a.div_ceil(32);
        let all = if self.itself {
            words
        } else {
            words + b.div_ceil(32)
        };
        let at_b = if self.itself { 0 } else { words };
        let mut masks = [a, b].map(|count| vec![false; count as usize]);
        for part in self.ask(Kind::Mask, [all, at_b])? {
            for (mask, first) in masks.iter_mut().zip([0, at_b as usize]) {
                for (i, set) in mask.iter_mut().enumerate() {
                    *set |= part.words[first + i / 32] >> (i % 32) & 1 == 1;
                }
            }
            for record in self.settled(&part)? {
                for (mask, triangle) in masks.iter_mut().zip(record.pair) {
                    mask[triangle as usize] = true;
                }
                if self.itself {
                    masks[0][record.pair[1] as usize] = true;
                }
            }
        }
        Ok(masks)
    }

    /// Of each job, the pairs that meet, sorted.
    pub(super) fn pairs(&self) -> Result<Vec<Vec<[u32; 2]>>, Error> {
        self.sorted(&self.ask(Kind::Pairs, [0, 0])?)
    }

    /// Of the only job, the pairs that meet and in what, sorted.
    pub(super) fn classified(&self) -> Result<Vec<ClassifiedPair>, Error> {
        let class = |record: &Record| {
            let [a, b] = record.posed(&self.poses[0]);
            let class = classify(&a, &b)?;
            let [a, b] = record.pair;
            Some(ClassifiedPair { a, b, class })
        };
        let records = self.meeting()?;
        let class = |i: usize| class(&records[i]);
        let classes = parallel::map(threads_for(records.len()), records.len(), class);
        Ok(classes.into_iter().flatten().collect())
    }

    /// Of the only job, where the surfaces meet.
    pub(super) fn curves(&self) -> Result<Curves, Error> {
        let records = self.meeting()?;
        let [mut of_a, mut of_b] = [BTreeMap::new(), BTreeMap::new()];
        for record in &records {
            let [a, b] = record.posed(&self.poses[0]);
            of_a.insert(record.pair[0], a);
            of_b.insert(record.pair[1], b);
        }
        let corners = |of: &BTreeMap<u32, [DVec3; 3]>| {
            let corners = |triangle| of.get(&triangle).copied().unwrap_or_default();
            Corners::new(of.keys().copied(), corners)
        };
        let (a, b) = if self.itself {
            of_a.extend(of_b);
            (corners(&of_a), None)
        } else {
            (corners(&of_a), Some(corners(&of_b)))
        };
        let mut builder = Builder::new(&a, b.as_ref());
        for record in &records {
            builder.add(record.pair);
        }
        Ok(builder.finish())
    }

    /// Of the only job, the pairs that meet with their corners, sorted.
    fn meeting(&self) -> Result<Vec<Record>, Error> {
        let parts = self.ask_as(Ask {
            leaves_hits: true,
            ..self.plain(Kind::Pairs, [0, 0])
        })?;
        let mut meeting = Vec::new();
        for part in &parts {
            for record in self.settled(part)? {
                let turned = self.ordered(record.pair) != record.pair;
                meeting.push(if turned { record.turned() } else { *record });
            }
        }
        meeting.sort_unstable_by_key(|record| record.pair);
        Ok(meeting)
    }

    /// What [`pairs`](Self::pairs) takes.
    pub(super) fn statistics(&self) -> Result<Statistics, Error> {
        let features = self.search.a.device.features();
        let timing = if features.contains(vertebra_gpu::wgpu::Features::TIMESTAMP_QUERY) {
            Timing::Whole
        } else {
            Timing::Off
        };
        let ask = self.plain(Kind::Pairs, [0, 0]);
        let parts = self.search.ask(ask, (0, timing), &self.jobs)?;
        let times = parts.iter().map(|part| part.gpu_time);
        let start = (!cfg!(target_arch = "wasm32")).then(Instant::now);
        for part in &parts {
            self.settled(part)?.for_each(drop);
        }
        let settle_time = start.map(|start| start.elapsed().as_secs_f64());
        Ok(Statistics {
            block_pairs: parts.iter().map(|part| part.block_pairs).sum(),
            hits: self
                .sorted(&parts)?
                .iter()
                .map(|list| list.len() as u64)
                .sum(),
            undecided: parts.iter().map(|part| part.undecided).sum(),
            on_host: parts.iter().map(|part| part.records.len() as u64).sum(),
            levels: match self.way {
                Way::Blocks { level } => level,
                Way::Moller(_) => 0,
            },
            gpu_time: times.sum(),
            settle_time,
        })
    }

    /// Of the only job, some rows of the matrix of pairs, so many words each: words in which certain pairs are set, and
    /// undecided pairs that meet.
    pub(super) fn rows(
        &self,
        first: u32,
        count: u32,
        words: u32,
    ) -> Result<(Vec<u32>, Vec<[u32; 2]>), Error> {
        let ask = Ask {
            rows: count,
            ..self.plain(Kind::Matrix, [words, 0])
        };
        let parts = self.search.ask(ask, (first, Timing::Off), &self.jobs)?;
        let mut bits = vec![0; words as usize * count as usize];
        let mut settled = Vec::new();
        for part in parts {
            for (bits, word) in bits.iter_mut().zip(&part.words) {
                *bits |= word;
            }
            settled.extend(self.settled(&part)?.map(|record| record.pair));
        }
        Ok((bits, settled))
    }

    /// The pairs found, and those of the undecided that meet, sorted.
    fn sorted(&self, parts: &[Found]) -> Result<Vec<Vec<[u32; 2]>>, Error> {
        let key = |&[a, b]: &[u32; 2]| u64::from(a) << 32 | u64::from(b);
        let mut lists = vec![Vec::new(); self.jobs.len()];
        let mut settled = lists.clone();
        for part in parts {
            for words in part.words.chunks_exact(3) {
                lists[part.first_job + words[2] as usize].push(self.ordered([words[0], words[1]]));
            }
            for record in self.settled(part)? {
                settled[part.first_job + record.job].push(self.ordered(record.pair));
            }
        }
        for (list, mut settled) in lists.iter_mut().zip(settled) {
            settled.sort_unstable_by_key(key);
            list.extend(settled);
            if parts.iter().any(|part| part.sorted) {
                // The stable sort merges what is in order.
                list.sort_by_key(key);
            } else {
                list.sort_unstable_by_key(key);
            }
        }
        Ok(lists)
    }

    /// Of one mesh the lesser index first.
    fn ordered(&self, [a, b]: [u32; 2]) -> [u32; 2] {
        if self.itself {
            [a.min(b), a.max(b)]
        } else {
            [a, b]
        }
    }

    /// Those of the undecided pairs of a part that count: many are shared out among the threads of the pool.
    fn settled<'p>(
        &self,
        part: &'p Found,
    ) -> Result<impl Iterator<Item = &'p Record> + use<'p>, Error> {
        let records = &part.records;
        let threads = threads_for(records.len());
        let settles = |i: usize| self.settles(part, &records[i]);
        let settled: Vec<bool> = parallel::map(threads, records.len(), settles)
            .into_iter()
            .collect::<Result<_, _>>()?;
        let records = records.iter().zip(settled);
        Ok(records.filter_map(|(record, counts)| counts.then_some(record)))
    }

    /// Whether an undecided pair counts.
    fn settles(&self, part: &Found, record: &Record) -> Result<bool, Error> {
        if self.itself {
            return Ok(record.meets_beyond());
        }
        let job = part.first_job + record.job;
        let pose = match self.poses.get(job) {
            Some(pose) => *pose,
            None => {
                let Job { a_pose, b_pose, .. } = self.jobs[job];
                let [a, b] = [a_pose, b_pose].map(|body| body_pose(&part.poses, body as usize));
                RelativePose::between(&a, &b)?
            }
        };
        Ok(record.meets(&pose))
    }

    /// Refuses poses from a buffer that are none.
    fn check_poses(&self, parts: &[Found]) -> Result<(), Error> {
        for part in parts {
            for index in 0..part.poses.len() / POSE {
                let pose = body_pose(&part.poses, index);
                RelativePose::between(&Pose::IDENTITY, &pose).map_err(|error| {
                    let error = Box::new(error);
                    QueryError::AtPose { index, error }
                })?;
            }
        }
        Ok(())
    }

    fn ask(&self, answer: Kind, words: [u32; 2]) -> Result<Vec<Found>, Error> {
        self.ask_as(self.plain(answer, words))
    }

    fn ask_as(&self, ask: Ask) -> Result<Vec<Found>, Error> {
        let parts = self.search.ask(ask, (0, Timing::Off), &self.jobs)?;
        self.check_poses(&parts)?;
        Ok(parts)
    }

    fn plain(&self, answer: Kind, words: [u32; 2]) -> Ask {
        Ask {
            answer,
            leaves_hits: false,
            words,
            rows: 0,
            way: self.way,
            itself: self.itself,
        }
    }
}

/// On how many threads to look at so many pairs.
fn threads_for(pairs: usize) -> usize {
    if pairs > MANY {
        parallel::available(0)
    } else {
        1
    }
}

/// A body's pose in a buffer of poses.
fn body_pose(words: &[f32], body: usize) -> Pose {
    let at = |k: usize| f64::from(words[POSE * body + k]);
    Pose::new(
        DQuat::from_xyzw(at(0), at(1), at(2), at(3)),
        DVec3::new(at(4), at(5), at(6)),
    )
}
