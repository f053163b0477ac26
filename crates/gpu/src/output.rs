//! What a run downloads.

use std::sync::Arc;

use bytemuck::Pod;

use crate::error::{Error, Failure};
use crate::program::Layout;
use crate::recording::{AnySlot, Slot};
use crate::run::Results;
use crate::timing::Timing;

/// Results of a run. Dropping it gives their memory to the next one.
#[derive(Debug)]
pub struct Output {
    layout: Arc<Layout>,
    timing: Timing,
    labels: Option<Arc<[String]>>,
    /// Nanoseconds of a tick.
    period: f32,
    // Before the memory it shows, so that it is dropped first.
    view: Option<wgpu::BufferView>,
    _results: Results,
}

impl Output {
    pub(crate) fn new(
        layout: Arc<Layout>,
        results: Results,
        timing: Timing,
        labels: Option<Arc<[String]>>,
        period: f32,
    ) -> Result<Self, Error> {
        let view = results
            .buffer
            .as_ref()
            .map(|buffer| buffer.get_mapped_range(..));
        let view = view.transpose().map_err(|error| Error::Driver {
            what: format!("reading the results of `{}`", layout.recording.name()),
            message: error.to_string(),
        })?;
        Ok(Self {
            layout,
            timing,
            labels,
            period,
            view,
            _results: results,
        })
    }

    /// What a buffer, or the part that was asked for, held where it was downloaded last.
    ///
    /// # Errors
    /// [`Error::WrongBuffer`] when the recording does not download it, or the slot is another's.
    pub fn read<T: Pod>(&self, slot: Slot<T>) -> Result<Vec<T>, Error> {
        let bytes = self.bytes(slot.any())?;
        let mut content = vec![T::zeroed(); bytes.len() / size_of::<T>().max(1)];
        bytemuck::cast_slice_mut(&mut content).copy_from_slice(bytes);
        Ok(content)
    }

    /// [`Output::read`] into memory of the caller's.
    ///
    /// # Errors
    /// [`Error::WrongBuffer`]; [`Error::Length`] unless there is a place for each element.
    pub fn read_into<T: Pod>(&self, slot: Slot<T>, content: &mut [T]) -> Result<(), Error> {
        let bytes = self.bytes(slot.any())?;
        let places: &mut [u8] = bytemuck::cast_slice_mut(content);
        if places.len() != bytes.len() {
            return Err(Error::Length {
                buffer: self.layout.recording.name_of(slot.any()).to_owned(),
                expected: (bytes.len() / size_of::<T>().max(1)) as u64,
                given: (places.len() / size_of::<T>().max(1)) as u64,
            });
        }
        places.copy_from_slice(bytes);
        Ok(())
    }

    /// Time that the run took \[s\], from and to where [`Timing`] says; none unless it was
    /// [taken](crate::Program::take_times).
    #[must_use]
    pub fn gpu_time(&self) -> Option<f64> {
        let ticks = self.ticks();
        Some(self.seconds(*ticks.first()?, *ticks.last()?))
    }

    /// Label and time \[s\] of each dispatch; none unless they were
    /// [taken](crate::Program::take_times).
    #[must_use]
    pub fn dispatch_times(&self) -> Vec<(&str, f64)> {
        let ticks = self.ticks();
        let labels = self.labels.iter().flat_map(|labels| labels.iter());
        labels
            .zip(ticks.chunks_exact(2))
            .map(|(label, pair)| (label.as_str(), self.seconds(pair[0], pair[1])))
            .collect()
    }

    /// The stages that reported failures.
    pub(crate) fn failures(&self) -> Vec<Failure> {
        let recording = &self.layout.recording;
        let words = recording.status.and_then(|status| self.read(status).ok());
        let words = words.unwrap_or_default();
        let Some((&bits, elements)) = words.split_first() else {
            return Vec::new();
        };
        let failed = elements.iter().enumerate();
        failed
            .filter(|(bit, _)| bits >> bit & 1 == 1)
            .map(|(bit, element)| Failure {
                stage: match recording.stages.get(bit) {
                    Some((_, name)) => name.clone(),
                    // By a kernel that writes the status word without the part `STATUS`.
                    None => format!("{bit}, which is not declared"),
                },
                element: !element,
            })
            .collect()
    }

    fn ticks(&self) -> Vec<u64> {
        if self.timing == Timing::Off {
            return Vec::new();
        }
        let first = usize::try_from(self.layout.ticks).unwrap_or(usize::MAX);
        let bytes = self.view.as_deref().and_then(|view| view.get(first..));
        bytes.map_or_else(Vec::new, bytemuck::pod_collect_to_vec)
    }

    /// Seconds between two ticks; some drivers let the end come first by a tick.
    fn seconds(&self, start: u64, end: u64) -> f64 {
        end.saturating_sub(start) as f64 * f64::from(self.period) * 1e-9
    }

    fn bytes(&self, slot: AnySlot) -> Result<&[u8], Error> {
        let recording = &self.layout.recording;
        let wrong = |reason| Error::WrongBuffer {
            buffer: recording.name_of(slot).to_owned(),
            reason,
        };
        if recording.declaration(slot).is_none() {
            return Err(wrong("the slot belongs to another recording"));
        }
        let mut downloads = self.layout.downloads.iter();
        let found = (|| {
            let (_, first, size) = downloads.find(|(downloaded, ..)| *downloaded == slot)?;
            let first = usize::try_from(*first).ok()?;
            let end = first.checked_add(usize::try_from(*size).ok()?)?;
            match self.view.as_deref() {
                Some(view) => view.get(first..end),
                // Nothing but empty buffers is downloaded.
                None => Some(&[][..]),
            }
        })();
        found.ok_or_else(|| {
            wrong("its recording does not download it: add `recording.download(slot)`")
        })
    }
}
