//! Buffers that outlive a program and are shared by several.

use std::marker::PhantomData;

use bytemuck::Pod;

use crate::device::Device;
use crate::error::{Error, Problem, Shortfall};
use crate::staging::SMALL;

/// Memory of a device for elements of one type, which several programs can use: see
/// [`Recording::shared`](crate::Recording::shared). Clones are the same memory.
#[derive(Debug)]
pub struct Buffer<T> {
    device: Device,
    name: String,
    raw: wgpu::Buffer,
    len: usize,
    element: PhantomData<fn() -> T>,
}

impl<T> Clone for Buffer<T> {
    fn clone(&self) -> Self {
        Self {
            device: self.device.clone(),
            name: self.name.clone(),
            raw: self.raw.clone(),
            len: self.len,
            element: PhantomData,
        }
    }
}

/// Uses that any buffer of elements may be put to.
pub(crate) const USES: wgpu::BufferUsages = wgpu::BufferUsages::STORAGE
    .union(wgpu::BufferUsages::UNIFORM)
    .union(wgpu::BufferUsages::COPY_SRC)
    .union(wgpu::BufferUsages::COPY_DST);

impl<T: Pod> Buffer<T> {
    pub(crate) fn new(device: &Device, name: &str, len: usize) -> Result<Self, Error> {
        let stride = size_of::<T>() as u64;
        let wrong = |problem| Error::Recording {
            recording: name.to_owned(),
            problems: vec![problem],
        };
        if stride == 0 || !stride.is_multiple_of(4) {
            return Err(wrong(Problem::Element {
                buffer: name.to_owned(),
                bytes: stride,
            }));
        }
        let Some(bytes) = stride.checked_mul(len as u64) else {
            return Err(wrong(Problem::Overflow {
                buffer: name.to_owned(),
                len: len as u64,
                stride,
            }));
        };
        let limit = device.limits().max_buffer_size;
        if bytes > limit {
            return Err(wrong(Problem::Limit {
                what: format!("buffer `{name}`"),
                shortfall: Shortfall::Limit {
                    limit: "max_buffer_size",
                    needed: bytes,
                    available: limit,
                },
            }));
        }
        Ok(Self {
            device: device.clone(),
            name: name.to_owned(),
            raw: allocate(device, name, bytes.max(stride), USES)?,
            len,
            element: PhantomData,
        })
    }

    /// Replaces the content before whatever is submitted next.
    ///
    /// Content of more than 64 KiB is copied by a submission of its own, through memory that is kept
    /// for the next of its size.
    ///
    /// # Errors
    /// [`Error::Length`] unless there is one element for each; [`Error::DeviceLost`];
    /// [`Error::OutOfMemory`].
    pub fn write(&self, content: &[T]) -> Result<(), Error> {
        write(&self.device, &self.name, &self.raw, self.len, content)
    }

    /// Its name.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The device whose memory it is.
    #[must_use]
    pub fn device(&self) -> &Device {
        &self.device
    }

    /// Number of elements.
    #[must_use]
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The buffer of wgpu.
    #[must_use]
    pub fn raw(&self) -> &wgpu::Buffer {
        &self.raw
    }
}

/// A buffer of zeros, of four words at least: an empty one could be neither bound nor mapped.
pub(crate) fn allocate(
    device: &Device,
    name: &str,
    bytes: u64,
    usage: wgpu::BufferUsages,
) -> Result<wgpu::Buffer, Error> {
    create(
        device,
        &format!("buffer `{name}`"),
        bytes.max(16),
        usage,
        false,
    )
}

/// Memory of the host's that is copied from, for it to be written now.
pub(crate) fn allocate_mapped(
    device: &Device,
    what: &str,
    bytes: u64,
) -> Result<wgpu::Buffer, Error> {
    let usage = wgpu::BufferUsages::MAP_WRITE | wgpu::BufferUsages::COPY_SRC;
    create(device, what, bytes, usage, true)
}

fn create(
    device: &Device,
    what: &str,
    size: u64,
    usage: wgpu::BufferUsages,
    mapped_at_creation: bool,
) -> Result<wgpu::Buffer, Error> {
    device.checked(what, size, |device, _| {
        device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(what),
            size,
            usage,
            mapped_at_creation,
        })
    })
}

/// Replaces the content of a buffer before whatever is submitted next.
pub(crate) fn write<T: Pod>(
    device: &Device,
    name: &str,
    buffer: &wgpu::Buffer,
    len: usize,
    content: &[T],
) -> Result<(), Error> {
    if content.len() != len {
        return Err(Error::Length {
            buffer: name.to_owned(),
            expected: len as u64,
            given: content.len() as u64,
        });
    }
    let bytes: &[u8] = bytemuck::cast_slice(content);
    if bytes.is_empty() {
        return Ok(());
    }
    let what = format!("writing buffer `{name}`");
    if bytes.len() > SMALL {
        return device.staging().write(device, &what, buffer, bytes);
    }
    device.checked(&what, bytes.len() as u64, |_, queue| {
        queue.write_buffer(buffer, 0, bytes);
    })
}
