//! What functions that record on a caller's buffers demand of these.

use crate::problem::Problem;
use crate::recording::{Recording, Slot};

impl Recording {
    /// Refuses the recording unless two buffers have equally many elements: for functions that
    /// record a computation on both.
    pub fn require_same_len<A, B>(&mut self, first: Slot<A>, second: Slot<B>) {
        let found = (
            self.declaration(first.any()),
            self.declaration(second.any()),
        );
        // A buffer of another recording is refused where it is used.
        if let (Some(a), Some(b)) = found
            && a.len != b.len
        {
            let problem = Problem::Lengths {
                what: self.scope_name(),
                first: a.name.clone(),
                first_len: a.len,
                second: b.name.clone(),
                second_len: b.len,
            };
            self.problems.push(problem);
        }
    }

    /// Refuses the recording unless a buffer has so many elements or more.
    pub fn require_len<T>(&mut self, slot: Slot<T>, least: u64) {
        if let Some(found) = self.declaration(slot.any())
            && found.len < least
        {
            let problem = Problem::Size {
                command: self.scope_name(),
                buffer: found.name.clone(),
                needed: least.saturating_mul(found.stride),
                available: found.bytes(),
            };
            self.problems.push(problem);
        }
    }
}
