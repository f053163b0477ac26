//! Queries over two meshes on a device.

use vertebra_gpu::Timing;
use vertebra_spatial::Pose;

use super::collider::Collider;
use super::error::Error;
use super::job::job;
use super::search::{Ask, Found, Kind, Search};
use crate::classify::classify;
use crate::culling::Culling;
use crate::query::ClassifiedPair;
use crate::transform::RelativePose;

/// A question about the colliding pairs of two meshes on a device: the verbs and the answers of [`crate::Query`].
///
/// It keeps its queues and its programs, so ask again with the same one: `query = query.pose_b(pose)?`.
#[derive(Debug)]
#[must_use]
pub struct Query {
    search: Search,
    pose: RelativePose,
    culling: Culling,
}

/// Pairs of blocks from which on the tree is descended: below, holding all against all takes less than the descent.
const WORTH_A_TREE: u64 = 1 << 24;

/// What a query took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Statistics {
    /// Pairs of blocks, of eight triangles each, whose boxes overlap.
    pub block_pairs: u64,
    /// Pairs of triangles that meet.
    pub hits: u64,
    /// Pairs of triangles that were left to the host.
    pub undecided: u64,
    /// Time on the device \[s], if it takes times.
    pub gpu_time: Option<f64>,
}

impl Query {
    /// A query over A and B, which stand where their files put them.
    ///
    /// # Errors
    ///
    /// [`Error::OtherDevice`].
    pub fn new(a: &Collider, b: &Collider) -> Result<Self, Error> {
        Ok(Self {
            search: Search::new(a.resident(), b.resident())?,
            pose: RelativePose::IDENTITY,
            culling: Culling::default(),
        })
    }

    /// Places both meshes in the world.
    ///
    /// # Errors
    ///
    /// A pose that [`RelativePose::between`] refuses.
    pub fn poses(self, a: Pose, b: Pose) -> Result<Self, Error> {
        Ok(self.relative(RelativePose::between(&a, &b)?))
    }

    /// Places mesh B, seen from A.
    ///
    /// # Errors
    ///
    /// A pose that [`RelativePose::between`] refuses.
    pub fn pose_b(self, b: Pose) -> Result<Self, Error> {
        self.poses(Pose::IDENTITY, b)
    }

    /// Places mesh B as this relative pose says.
    pub fn relative(mut self, pose: RelativePose) -> Self {
        self.pose = pose;
        self
    }

    /// Chooses how pairs are culled: blocks all against all, or down the tree of A.
    pub fn culling(mut self, culling: Culling) -> Self {
        self.culling = culling;
        self
    }

    /// Whether any two triangles meet.
    ///
    /// # Errors
    ///
    /// [`Error::Device`]; [`Error::Mesh`] for vertices that the device has found not to be finite.
    pub fn any(&self) -> Result<bool, Error> {
        let parts = self.ask(Kind::Any, [1, 0])?;
        let certain = parts
            .iter()
            .any(|part| part.words.iter().any(|word| *word != 0));
        let mut records = parts.iter().flat_map(|part| &part.records);
        Ok(certain || records.any(|record| record.meets(&self.pose)))
    }

    /// How many pairs of triangles meet.
    ///
    /// # Errors
    ///
    /// As for [`any`](Self::any).
    pub fn count(&self) -> Result<u64, Error> {
        let parts = self.ask(Kind::Count, [1, 0])?;
        let certain: u64 = parts.iter().flat_map(first_word).sum();
        let records = parts.iter().flat_map(|part| &part.records);
        Ok(certain + records.filter(|record| record.meets(&self.pose)).count() as u64)
    }

    /// Which triangles of A and which of B meet some triangle of the other mesh.
    ///
    /// # Errors
    ///
    /// As for [`any`](Self::any).
    pub fn mask(&self) -> Result<(Vec<bool>, Vec<bool>), Error> {
        let counts = [self.search.a.triangles, self.search.b.triangles];
        let words = counts.map(|count| count.div_ceil(32));
        let parts = self.ask(Kind::Mask, [words[0] + words[1], words[0]])?;
        let [mut a, mut b] = counts.map(|count| vec![false; count as usize]);
        for part in &parts {
            let (of_a, of_b) = part.words.split_at(words[0] as usize);
            for (mask, bits) in [(&mut a, of_a), (&mut b, of_b)] {
                for (i, set) in mask.iter_mut().enumerate() {
                    *set |= bits[i / 32] >> (i % 32) & 1 == 1;
                }
            }
            for record in part.records.iter().filter(|r| r.meets(&self.pose)) {
                a[record.pair[0] as usize] = true;
                b[record.pair[1] as usize] = true;
            }
        }
        Ok((a, b))
    }

    /// All pairs (triangle of A, triangle of B) that meet, in lexicographic order.
    ///
    /// # Errors
    ///
    /// As for [`any`](Self::any).
    pub fn pairs(&self) -> Result<Vec<[u32; 2]>, Error> {
        Ok(self.sorted(&self.ask(Kind::Pairs, [0, 0])?))
    }

    /// All pairs that meet, in lexicographic order, each with what it meets in.
    ///
    /// # Errors
    ///
    /// As for [`any`](Self::any).
    pub fn classified(&self) -> Result<Vec<ClassifiedPair>, Error> {
        let ask = Ask {
            leaves_hits: true,
            ..self.plain(Kind::Pairs, [0, 0])
        };
        let parts = self.search.ask(ask, (0, Timing::Off), &[self.job()])?;
        let records = parts.iter().flat_map(|part| &part.records);
        let class = |record: &super::settle::Record| {
            let [a, b] = record.posed(&self.pose);
            let class = classify(&a, &b)?;
            let [a, b] = record.pair;
            Some(ClassifiedPair { a, b, class })
        };
        let mut pairs: Vec<_> = records.filter_map(class).collect();
        pairs.sort_unstable_by_key(|pair| [pair.a, pair.b]);
        Ok(pairs)
    }

    /// What [`pairs`](Self::pairs) takes.
    ///
    /// # Errors
    ///
    /// As for [`any`](Self::any).
    pub fn statistics(&self) -> Result<Statistics, Error> {
        let timed = self.search.a.device.features();
        let timing = if timed.contains(vertebra_gpu::wgpu::Features::TIMESTAMP_QUERY) {
            Timing::Whole
        } else {
            Timing::Off
        };
        let ask = self.plain(Kind::Pairs, [0, 0]);
        let parts = self.search.ask(ask, (0, timing), &[self.job()])?;
        let times = parts.iter().map(|part| part.gpu_time);
        Ok(Statistics {
            block_pairs: parts.iter().map(|part| part.block_pairs).sum(),
            hits: self.sorted(&parts).len() as u64,
            undecided: parts.iter().map(|part| part.records.len() as u64).sum(),
            gpu_time: times.sum(),
        })
    }

    fn job(&self) -> vertebra_shaders::collision::Job {
        job(&self.pose, self.search.a.blocks(), self.search.b.blocks())
    }

    fn plain(&self, answer: Kind, words: [u32; 2]) -> Ask {
        let [a, b] = [&self.search.a, &self.search.b].map(|mesh| u64::from(mesh.blocks()));
        Ask {
            answer,
            leaves_hits: false,
            words,
            rows: 0,
            tree: match self.culling {
                Culling::AllPairs => false,
                Culling::Bvh => true,
                Culling::Auto => a * b > WORTH_A_TREE,
            },
        }
    }

    fn ask(&self, answer: Kind, words: [u32; 2]) -> Result<Vec<Found>, Error> {
        let ask = self.plain(answer, words);
        self.search.ask(ask, (0, Timing::Off), &[self.job()])
    }

    /// The pairs found, and those of the undecided that meet, sorted.
    fn sorted(&self, parts: &[Found]) -> Vec<[u32; 2]> {
        let certain = parts.iter().flat_map(|part| part.words.chunks_exact(3));
        let certain = certain.map(|words| [words[0], words[1]]);
        let records = parts.iter().flat_map(|part| &part.records);
        let settled = records.filter(|record| record.meets(&self.pose));
        let mut pairs: Vec<_> = certain.chain(settled.map(|record| record.pair)).collect();
        pairs.sort_unstable();
        pairs
    }
}

fn first_word(part: &Found) -> Option<u64> {
    part.words.first().map(|word| u64::from(*word))
}
