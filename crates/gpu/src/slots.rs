//! The buffers in the slots of a recording: made, or given.

use crate::buffer::{USES, allocate, write};
use crate::device::Device;
use crate::error::{Error, Problem};
use crate::recording::{AnySlot, Command, Declaration, Groups, Recording, Shared};

/// The buffers of a checked recording, in the order of its declarations.
pub(crate) fn fill(
    device: &Device,
    recording: &Recording,
    shared: &[Shared],
) -> Result<Vec<wgpu::Buffer>, Error> {
    let indirect = indirect(recording);
    let mut given = vec![None; recording.buffers.len()];
    let mut problems = Vec::new();
    for (number, shared_buffer) in shared.iter().enumerate() {
        let before = &shared[..number];
        match wrong(device, recording, &indirect, before, shared_buffer) {
            None => given[shared_buffer.slot.index as usize] = Some(&shared_buffer.buffer),
            Some(problem) => problems.push(problem),
        }
    }
    for (number, declaration) in recording.buffers.iter().enumerate() {
        let is_this =
            |s: &Shared| s.slot.index as usize == number && recording.declaration(s.slot).is_some();
        if declaration.shared && !shared.iter().any(is_this) {
            problems.push(Problem::Shared {
                buffer: declaration.name.clone(),
                reason: "no buffer was given for it",
            });
        }
    }
    if !problems.is_empty() {
        return Err(Error::Recording {
            recording: recording.name().to_owned(),
            problems,
        });
    }
    let declarations = recording.buffers.iter().zip(indirect).zip(given);
    declarations
        .map(|((declaration, indirect), given)| match given {
            Some(buffer) => Ok(buffer.clone()),
            None => make(device, declaration, indirect),
        })
        .collect()
}

/// Which buffers hold numbers of workgroups.
fn indirect(recording: &Recording) -> Vec<bool> {
    let mut indirect = vec![false; recording.buffers.len()];
    for command in &recording.commands {
        if let Command::Dispatch(dispatch) = command
            && let Groups::Indirect(slot, _) = dispatch.groups
        {
            indirect[slot.index as usize] = true;
        }
    }
    indirect
}

/// What is wrong with a buffer that is given, after these.
fn wrong(
    device: &Device,
    recording: &Recording,
    indirect: &[bool],
    before: &[Shared],
    given: &Shared,
) -> Option<Problem> {
    let declaration = recording.declaration(given.slot);
    let reason = match declaration {
        None => "the slot it is given for belongs to another recording",
        Some(declaration) if !declaration.shared => "it was not declared as shared",
        _ if !device.is(&given.device) => "the buffer given belongs to another device",
        Some(declaration) if given.len != declaration.len => "the buffer given has another length",
        _ if indirect[given.slot.index as usize] => {
            "numbers of workgroups must lie in the recording's own buffers"
        }
        _ if before.iter().any(|other| other.slot == given.slot) => "two buffers are given for it",
        _ if before.iter().any(|other| other.buffer == given.buffer) => {
            "the buffer given is in another slot already"
        }
        _ => return None,
    };
    let name = declaration.map_or(&given.name, |declaration| &declaration.name);
    Some(Problem::Shared {
        buffer: name.clone(),
        reason,
    })
}

fn make(device: &Device, declaration: &Declaration, indirect: bool) -> Result<wgpu::Buffer, Error> {
    let name = &declaration.name;
    let mut usage = USES;
    // Only where needed: it costs a bind group each.
    usage.set(wgpu::BufferUsages::INDIRECT, indirect);
    let buffer = allocate(device, name, bound_bytes(declaration), usage)?;
    if let Some(content) = &declaration.content {
        write(device, name, &buffer, content.len(), content)?;
    }
    Ok(buffer)
}

/// What a kernel is bound to: all elements, so that `arrayLength` is their number. No binding is
/// empty: instead of no element there is one.
fn bound_bytes(declaration: &Declaration) -> u64 {
    declaration.bytes().max(declaration.stride)
}

/// The buffer in a slot as a kernel is bound to it.
pub(crate) fn resource<'a>(
    recording: &Recording,
    buffers: &'a [wgpu::Buffer],
    slot: AnySlot,
) -> wgpu::BindingResource<'a> {
    let bytes = recording.declaration(slot).map_or(0, bound_bytes);
    wgpu::BindingResource::Buffer(wgpu::BufferBinding {
        buffer: &buffers[slot.index as usize],
        offset: 0,
        size: wgpu::BufferSize::new(bytes),
    })
}
