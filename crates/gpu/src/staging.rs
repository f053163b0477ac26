//! Memory through which content reaches a device.
//!
//! `Queue::write_buffer` of wgpu takes it by itself, and gives the device up where there is none. Here
//! it is taken as any other buffer is, so that a full memory is an error and no more; it is kept for
//! the next content of the same size.

use std::sync::{Arc, Mutex};

use crate::buffer::allocate_mapped;
use crate::device::{Device, lock};
use crate::error::Error;

/// Content up to this size \[byte\] goes through `Queue::write_buffer`, which needs no submission of
/// its own: 256 of them fit into a block of 16 MiB that wgpu shares out. Where not even one more such
/// block can be had, the device is lost.
pub(crate) const SMALL: usize = 1 << 16;

/// Most memory that is kept \[byte\]: what is larger takes longer to copy than to allocate.
const KEPT: u64 = 64 << 20;

/// Memory that is mapped and not in use, the latest last.
#[derive(Debug, Default)]
pub(crate) struct Staging {
    idle: Arc<Mutex<Vec<wgpu::Buffer>>>,
}

impl Staging {
    /// Replaces the first bytes of a buffer before whatever is submitted next. They are whole words.
    pub(crate) fn write(
        &self,
        device: &Device,
        what: &str,
        buffer: &wgpu::Buffer,
        bytes: &[u8],
    ) -> Result<(), Error> {
        let size = bytes.len() as u64;
        let from = self.take(device, what, size)?;
        match from.get_mapped_range_mut(..size) {
            Ok(mut view) => view.copy_from_slice(bytes),
            Err(error) => {
                return Err(device.explained(Error::Driver {
                    what: what.to_owned(),
                    message: error.to_string(),
                }));
            }
        }
        from.unmap();
        let idle = Arc::clone(&self.idle);
        device.checked(what, size, |device, queue| {
            let label = Some(what);
            let mut encoder =
                device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label });
            encoder.copy_buffer_to_buffer(&from, 0, buffer, 0, size);
            queue.submit([encoder.finish()]);
            if from.size() <= KEPT {
                let again = from.clone();
                from.map_async(wgpu::MapMode::Write, .., move |mapped| {
                    if mapped.is_ok() {
                        keep(&mut lock(&idle), again);
                    }
                });
            }
        })
    }

    /// Mapped memory of this size.
    fn take(&self, device: &Device, what: &str, size: u64) -> Result<wgpu::Buffer, Error> {
        let found = || {
            let mut idle = lock(&self.idle);
            let place = idle.iter().position(|buffer| buffer.size() == size)?;
            Some(idle.remove(place))
        };
        if let Some(buffer) = found() {
            return Ok(buffer);
        }
        // What the device is done with comes back when it is asked.
        device.poll(what, wgpu::PollType::Poll)?;
        if let Some(buffer) = found() {
            return Ok(buffer);
        }
        let allocated = allocate_mapped(device, what, size);
        if let Err(Error::OutOfMemory { .. }) = allocated {
            lock(&self.idle).clear();
            return allocate_mapped(device, what, size);
        }
        allocated
    }
}

/// Keeps memory, and as much of what was kept before as there is place for.
fn keep(idle: &mut Vec<wgpu::Buffer>, buffer: wgpu::Buffer) {
    idle.push(buffer);
    let mut bytes: u64 = idle.iter().map(wgpu::Buffer::size).sum();
    while bytes > KEPT {
        bytes -= idle.remove(0).size();
    }
}
