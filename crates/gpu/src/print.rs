//! A recording as text: its buffers, then its commands in order.

use std::fmt;

use crate::kernel::Access;
use crate::recording::{AnySlot, Command, Dispatch, Extent, Groups, Recording};

impl fmt::Display for Recording {
    /// One line a buffer, one line a command.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "recording `{}`: {} buffers, {} commands, {} of them dispatches",
            self.name,
            self.buffers.len(),
            self.commands.len(),
            self.dispatches()
        )?;
        for buffer in &self.buffers {
            let element = buffer.element.rsplit("::").next().unwrap_or_default();
            let kind = match (&buffer.content, buffer.shared) {
                (_, true) => ", shared",
                (Some(_), _) => ", with content",
                _ => "",
            };
            writeln!(f, "  {}: [{element}; {}]{kind}", buffer.name, buffer.len)?;
        }
        for (number, command) in self.commands.iter().enumerate() {
            write!(f, "  {number:>3} ")?;
            match command {
                Command::Upload { to, data } => {
                    writeln!(f, "upload {} bytes to {}", data.len(), self.name_of(*to))?;
                }
                Command::Copy { from, to } => {
                    writeln!(f, "copy {} to {}", self.name_of(*from), self.name_of(*to))?;
                }
                Command::Clear(slot) => writeln!(f, "clear {}", self.name_of(*slot))?,
                Command::Download(slot, extent) => {
                    write!(f, "download ")?;
                    if let Extent::Part(start, end) = extent {
                        write!(f, "bytes {start} to {end} of ")?;
                    }
                    writeln!(f, "{}", self.name_of(*slot))?;
                }
                Command::Dispatch(dispatch) => self.print_dispatch(f, dispatch)?,
            }
        }
        Ok(())
    }
}

impl Recording {
    fn print_dispatch(&self, f: &mut fmt::Formatter<'_>, dispatch: &Dispatch) -> fmt::Result {
        write!(f, "dispatch {}", dispatch.label)?;
        match dispatch.groups {
            Groups::Direct([x, y, z]) => write!(f, " {x} x {y} x {z}")?,
            Groups::Indirect(slot, offset) => {
                write!(f, " as {} says at word {}", self.name_of(slot), offset / 4)?;
            }
        }
        let mut separator = ": ";
        for (place, slot) in dispatch.buffers.iter().enumerate() {
            let sign = match dispatch.kernel.bindings().get(place).map(|b| b.access) {
                Some(Access::ReadWrite) => "*",
                _ => "",
            };
            write!(f, "{separator}{sign}{}", self.name_of(*slot))?;
            separator = ", ";
        }
        writeln!(f)
    }

    pub(crate) fn name_of(&self, slot: AnySlot) -> &str {
        let declaration = self.declaration(slot);
        declaration.map_or("(of another recording)", |d| &d.name)
    }
}
