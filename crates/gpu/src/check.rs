//! Checks of a recording against a device's limits and features: no GPU is needed.

use crate::error::{Error, Problem, Shortfall};
use crate::kernel::Access;
use crate::recording::{AnySlot, Command, Declaration, Dispatch, Extent, Groups, Recording, Slot};

impl Recording {
    /// Checks everything that a device with these limits and features would refuse: sizes,
    /// bindings, uses, workgroups, features.
    ///
    /// # Errors
    /// [`Error::Recording`] with all problems.
    pub fn check(&self, limits: &wgpu::Limits, features: wgpu::Features) -> Result<(), Error> {
        let mut checker = Checker {
            recording: self,
            limits,
            features,
            problems: self.problems.clone(),
        };
        self.buffers.iter().for_each(|b| checker.buffer(b));
        for (number, command) in self.commands.iter().enumerate() {
            checker.command(number, command);
        }
        checker.downloads();
        if self.stages.len() > 32 {
            checker.problems.push(Problem::Stages {
                stages: self.stages.len(),
            });
        }
        if checker.problems.is_empty() {
            return Ok(());
        }
        Err(Error::Recording {
            recording: self.name.clone(),
            problems: checker.problems,
        })
    }
}

struct Checker<'a> {
    recording: &'a Recording,
    limits: &'a wgpu::Limits,
    features: wgpu::Features,
    problems: Vec<Problem>,
}

impl<'a> Checker<'a> {
    fn buffer(&mut self, buffer: &Declaration) {
        if buffer.len.checked_mul(buffer.stride).is_none() {
            self.problems.push(Problem::Overflow {
                buffer: buffer.name.clone(),
                len: buffer.len,
                stride: buffer.stride,
            });
            return;
        }
        if buffer.stride == 0 || !buffer.stride.is_multiple_of(4) {
            self.problems.push(Problem::Element {
                buffer: buffer.name.clone(),
                bytes: buffer.stride,
            });
        }
        self.limit(
            || format!("buffer `{}`", buffer.name),
            "max_buffer_size",
            buffer.bytes(),
            self.limits.max_buffer_size,
        );
    }

    /// All that is downloaded goes into one buffer.
    fn downloads(&mut self) {
        let status = self.recording.status.map(Slot::any);
        let downloads = self.recording.downloads();
        let own = downloads.filter(|(_, slot, _)| Some(*slot) != status);
        let mut sizes: Vec<u64> = own.map(|(.., [start, end])| end - start).collect();
        let status = status.and_then(|status| self.recording.declaration(status));
        sizes.extend(status.map(Declaration::bytes));
        let bytes = sizes.iter().copied().fold(0, u64::saturating_add);
        if sizes.len() > 1 {
            let what = || "what is downloaded, together,".to_owned();
            self.limit(what, "max_buffer_size", bytes, self.limits.max_buffer_size);
        }
    }

    fn command(&mut self, number: usize, command: &Command) {
        match command {
            Command::Upload { to, data } => {
                let name = format!("upload {number}");
                self.holds(&name, *to, data.len() as u64);
                self.keeps_status(&name, *to);
            }
            Command::Copy { from, to } => {
                let name = format!("copy {number}");
                let found = (self.find(&name, *from), self.find(&name, *to));
                if let (Some(first), Some(second)) = found
                    && first.len != second.len
                {
                    self.problems.push(Problem::Lengths {
                        what: name.clone(),
                        first: first.name.clone(),
                        first_len: first.len,
                        second: second.name.clone(),
                        second_len: second.len,
                    });
                }
                if from == to {
                    self.alias(&name, *from);
                }
                self.keeps_status(&name, *to);
            }
            Command::Clear(slot) => {
                let name = format!("clear {number}");
                self.find(&name, *slot);
                self.keeps_status(&name, *slot);
            }
            Command::Download(slot, extent) => {
                let name = format!("download {number}");
                match *extent {
                    Extent::Whole => {
                        self.find(&name, *slot);
                    }
                    Extent::Part(_, end) => self.holds(&name, *slot, end),
                }
            }
            Command::Dispatch(dispatch) => self.dispatch(number, dispatch),
        }
    }

    fn dispatch(&mut self, number: usize, dispatch: &Dispatch) {
        let name = format!("dispatch {number} `{}`", dispatch.label);
        let kernel = &dispatch.kernel;
        let lacking = kernel.features() - self.features;
        if !lacking.is_empty() {
            let features: Vec<_> = lacking.iter_names().map(|(name, _)| name).collect();
            self.problems.push(Problem::Feature {
                command: name.clone(),
                features: features.join(", "),
            });
        }
        self.workgroup(&name, dispatch);
        if kernel.bindings().len() != dispatch.buffers.len() {
            self.problems.push(Problem::BindingCount {
                command: name,
                expected: kernel.bindings().len(),
                given: dispatch.buffers.len(),
            });
            return;
        }
        self.bindings(&name, dispatch);
        self.stage(&name, dispatch);
        if let Groups::Indirect(slot, offset) = dispatch.groups {
            self.holds(&name, slot, offset.saturating_add(12));
            let written = |(binding, used): (&crate::Binding, &AnySlot)| {
                binding.access == Access::ReadWrite && *used == slot
            };
            if kernel.bindings().iter().zip(&dispatch.buffers).any(written) {
                self.alias(&name, slot);
            }
        }
    }

    fn workgroup(&mut self, name: &str, dispatch: &Dispatch) {
        let (kernel, limits) = (&dispatch.kernel, self.limits);
        let [x, y, z] = kernel.workgroup_size().map(u64::from);
        let mut sizes = vec![
            (
                "max_compute_workgroup_size_x",
                x,
                limits.max_compute_workgroup_size_x,
            ),
            (
                "max_compute_workgroup_size_y",
                y,
                limits.max_compute_workgroup_size_y,
            ),
            (
                "max_compute_workgroup_size_z",
                z,
                limits.max_compute_workgroup_size_z,
            ),
            (
                "max_compute_invocations_per_workgroup",
                x.saturating_mul(y).saturating_mul(z),
                limits.max_compute_invocations_per_workgroup,
            ),
            (
                "max_compute_workgroup_storage_size",
                kernel.workgroup_memory().into(),
                limits.max_compute_workgroup_storage_size,
            ),
        ];
        if let Groups::Direct(groups) = dispatch.groups {
            let most = limits.max_compute_workgroups_per_dimension;
            for count in groups {
                sizes.push(("max_compute_workgroups_per_dimension", count.into(), most));
            }
        }
        let count = |uniform: bool| {
            let is_kind = |b: &&crate::Binding| (b.access == Access::Uniform) == uniform;
            kernel.bindings().iter().filter(is_kind).count() as u64
        };
        sizes.push((
            "max_storage_buffers_per_shader_stage",
            count(false),
            limits.max_storage_buffers_per_shader_stage,
        ));
        sizes.push((
            "max_uniform_buffers_per_shader_stage",
            count(true),
            limits.max_uniform_buffers_per_shader_stage,
        ));
        for (limit, needed, available) in sizes {
            self.limit(|| name.to_owned(), limit, needed, available.into());
        }
    }

    fn bindings(&mut self, name: &str, dispatch: &Dispatch) {
        let bindings = dispatch.kernel.bindings();
        for (place, (binding, &slot)) in bindings.iter().zip(&dispatch.buffers).enumerate() {
            let Some(buffer) = self.find(name, slot) else {
                continue;
            };
            if buffer.stride != u64::from(binding.stride) {
                self.problems.push(Problem::Stride {
                    command: name.to_owned(),
                    binding: binding.name,
                    buffer: buffer.name.clone(),
                    expected: binding.stride.into(),
                    given: buffer.stride,
                });
            }
            let (limit, available) = match binding.access {
                Access::Uniform => (
                    "max_uniform_buffer_binding_size",
                    self.limits.max_uniform_buffer_binding_size,
                ),
                _ => (
                    "max_storage_buffer_binding_size",
                    self.limits.max_storage_buffer_binding_size,
                ),
            };
            let what = || format!("{name}, buffer `{}`,", buffer.name);
            self.limit(what, limit, buffer.bytes(), available);
            let writes = |a: Access, b: Access| a == Access::ReadWrite || b == Access::ReadWrite;
            let twice = |(other, used): (&crate::Binding, &AnySlot)| {
                *used == slot && writes(other.access, binding.access)
            };
            let before = bindings.iter().zip(&dispatch.buffers).take(place);
            if before.into_iter().any(twice) {
                self.alias(name, slot);
            }
        }
    }

    /// A failure must be told: it needs the status word and a stage of this recording.
    fn stage(&mut self, name: &str, dispatch: &Dispatch) {
        if !dispatch.kernel.can_fail() {
            return;
        }
        let status = self.recording.status.map(Slot::any);
        let reason = match dispatch.kernel.stage() {
            _ if status.is_none() || dispatch.buffers.last() != status.as_ref() => {
                "its last buffer is not `recording.status()`"
            }
            None => {
                "has no stage: give it `.constant(\"STAGE\", stage)` with `recording.stage(name)`"
            }
            Some(stage) if !self.recording.has_stage(stage) => {
                "its stage is one of another recording"
            }
            Some(_) => return,
        };
        self.problems.push(Problem::Stage {
            command: name.to_owned(),
            reason,
        });
    }

    /// Only kernels write the status word: else failures before would be lost.
    fn keeps_status(&mut self, command: &str, written: AnySlot) {
        if self.recording.status.map(Slot::any) == Some(written)
            && let Some(status) = self.recording.declaration(written)
        {
            self.problems.push(Problem::Status {
                command: command.to_owned(),
                buffer: status.name.clone(),
            });
        }
    }

    /// The declaration of a buffer of this recording.
    fn find(&mut self, command: &str, slot: AnySlot) -> Option<&'a Declaration> {
        let found = self.recording.declaration(slot);
        if found.is_none() {
            self.problems.push(Problem::Foreign {
                command: command.to_owned(),
            });
        }
        found
    }

    fn holds(&mut self, command: &str, slot: AnySlot, needed: u64) {
        if let Some(buffer) = self.find(command, slot) {
            let (buffer, available) = (buffer.name.clone(), buffer.bytes());
            if available < needed {
                self.problems.push(Problem::Size {
                    command: command.to_owned(),
                    buffer,
                    needed,
                    available,
                });
            }
        }
    }

    fn alias(&mut self, command: &str, slot: AnySlot) {
        if let Some(buffer) = self.recording.declaration(slot) {
            self.problems.push(Problem::Alias {
                command: command.to_owned(),
                buffer: buffer.name.clone(),
            });
        }
    }

    fn limit(
        &mut self,
        what: impl FnOnce() -> String,
        limit: &'static str,
        needed: u64,
        available: u64,
    ) {
        if needed > available {
            self.problems.push(Problem::Limit {
                what: what(),
                shortfall: Shortfall::Limit {
                    limit,
                    needed,
                    available,
                },
            });
        }
    }
}
