//! Names that must be unique, whatever the file calls its elements.

use std::collections::HashMap;

/// Names in use, and new ones beside them.
#[derive(Default)]
pub(crate) struct Names {
    /// Names, each with the number that was last put behind it.
    taken: HashMap<String, usize>,
}

impl Names {
    /// Takes a name if it is free.
    pub(crate) fn take(&mut self, name: &str) -> bool {
        match self.taken.contains_key(name) {
            true => false,
            false => self.taken.insert(name.to_owned(), 1).is_none(),
        }
    }

    /// The name, or the first of `name_2`, `name_3`, ... that is free.
    pub(crate) fn fresh(&mut self, name: String) -> String {
        if self.take(&name) {
            return name;
        }
        loop {
            let number = self.taken.get_mut(&name).map_or(2, |last| {
                *last += 1;
                *last
            });
            let numbered = format!("{name}_{number}");
            if self.take(&numbered) {
                return numbered;
            }
        }
    }
}
