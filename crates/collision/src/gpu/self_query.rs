//! Queries over one mesh on a device.

use super::batch::Batch;
use super::collider::Collider;
use super::error::Error;
use super::job::job;
use super::query::Statistics;
use super::search::Search;
use crate::culling::Culling;
use crate::curves::Curves;
use crate::query::ClassifiedPair;
use crate::transform::RelativePose;

/// A question about the triangles of one mesh that meet each other where they should not: the verbs and the answers of
/// [`crate::SelfQuery`], for where the vertices are on the device.
#[derive(Debug)]
#[must_use]
pub struct SelfQuery {
    search: Search,
    culling: Culling,
}

impl SelfQuery {
    /// A query over a mesh.
    pub fn new(mesh: &Collider) -> Self {
        Self {
            search: Search::of(mesh.resident(), mesh.resident()),
            culling: Culling::default(),
        }
    }

    /// Chooses how pairs are culled: blocks all against all, or down the tree.
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
        Ok(self.batch().any()?.contains(&true))
    }

    /// How many pairs of triangles meet.
    ///
    /// # Errors
    ///
    /// As for [`any`](Self::any).
    pub fn count(&self) -> Result<u64, Error> {
        Ok(self.batch().count()?.iter().sum())
    }

    /// Which triangles meet some other.
    ///
    /// # Errors
    ///
    /// As for [`any`](Self::any).
    pub fn mask(&self) -> Result<Vec<bool>, Error> {
        let [mask, _] = self.batch().mask([self.search.a.triangles; 2])?;
        Ok(mask)
    }

    /// All pairs of triangles that meet, the lesser index first, in lexicographic order.
    ///
    /// # Errors
    ///
    /// As for [`any`](Self::any).
    pub fn pairs(&self) -> Result<Vec<[u32; 2]>, Error> {
        Ok(self.batch().pairs()?.pop().unwrap_or_default())
    }

    /// All pairs of triangles that meet, the lesser index first, in lexicographic order, each with what it meets in: see
    /// [`crate::SelfQuery::classified`].
    ///
    /// # Errors
    ///
    /// As for [`any`](Self::any).
    pub fn classified(&self) -> Result<Vec<ClassifiedPair>, Error> {
        self.batch().classified()
    }

    /// Where the surface meets itself, as polylines.
    ///
    /// # Errors
    ///
    /// As for [`any`](Self::any).
    pub fn curves(&self) -> Result<Curves, Error> {
        self.batch().curves()
    }

    /// What [`pairs`](Self::pairs) takes.
    ///
    /// # Errors
    ///
    /// As for [`any`](Self::any).
    pub fn statistics(&self) -> Result<Statistics, Error> {
        self.batch().statistics()
    }

    fn batch(&self) -> Batch<'_> {
        let blocks = [0, self.search.a.blocks()];
        let mut job = job(&RelativePose::IDENTITY, blocks, blocks);
        job.itself = 1;
        let poses = vec![RelativePose::IDENTITY];
        Batch::new(&self.search, poses, vec![job], self.culling)
    }
}
