//! Encoding a run: the only place that does.

use crate::program::{Bound, BoundGroups, Step};
use crate::timing::{Clock, Timing};

/// What a run is encoded from, and what into.
pub(crate) struct Run<'a> {
    pub(crate) encoder: &'a mut wgpu::CommandEncoder,
    /// Cleared once: failures are those of all repetitions.
    pub(crate) status: Option<&'a wgpu::Buffer>,
    pub(crate) steps: &'a [Step],
    pub(crate) clock: Option<&'a Clock>,
    /// Where downloads go.
    pub(crate) results: Option<&'a wgpu::Buffer>,
    /// First byte of the timestamps there.
    pub(crate) ticks: u64,
}

impl<'a> Run<'a> {
    /// All steps so many times; the last repetition downloads.
    pub(crate) fn encode(&mut self, repetitions: u32) {
        let commands = self.clock_for(Timing::Commands);
        if let Some(clock) = commands {
            clock.start(self.encoder);
        }
        if let Some(status) = self.status {
            self.encoder.clear_buffer(status, 0, None);
        }
        // Where nothing is between repetitions they go on in one pass.
        let alone =
            matches!(self.steps, [Step::Pass(_), rest @ ..] if rest.iter().all(Step::is_download));
        let each = self.clock_for(Timing::Dispatches).is_some();
        let (rounds, in_a_pass) = if alone && !each {
            (repetitions.min(1), repetitions)
        } else {
            (repetitions, 1)
        };
        for round in 1..=rounds {
            self.round(round == 1, round == rounds, in_a_pass);
        }
        if repetitions == 0 {
            let downloads = self.steps.iter().filter(|step| step.is_download());
            downloads.for_each(|download| self.transfer(download));
        }
        if let Some(clock) = commands {
            clock.end(self.encoder);
        }
        if let (Some(clock), Some(results)) = (self.clock, self.results) {
            clock.download(self.encoder, results, self.ticks);
        }
    }

    fn round(&mut self, is_first: bool, is_last: bool, in_a_pass: u32) {
        let steps = self.steps;
        let whole = self.clock_for(Timing::Whole);
        let each = self.clock_for(Timing::Dispatches).filter(|_| is_last);
        let is_pass = |step: &Step| matches!(step, Step::Pass(_));
        let (first_pass, last_pass) = (
            steps.iter().position(is_pass),
            steps.iter().rposition(is_pass),
        );
        let mut timed = 0;
        for (place, step) in steps.iter().enumerate() {
            match (step, each) {
                (Step::Pass(dispatches), Some(clock)) => {
                    for dispatch in dispatches {
                        self.pass(std::slice::from_ref(dispatch), 1, clock.around(timed));
                        timed += 1;
                    }
                }
                (Step::Pass(dispatches), None) => {
                    let start = is_first && first_pass == Some(place);
                    let end = is_last && last_pass == Some(place);
                    let times = whole.and_then(|clock| clock.writes(0, [start, end]));
                    self.pass(dispatches, in_a_pass, times);
                }
                (Step::Download { .. }, _) if !is_last => {}
                (transfer, _) => self.transfer(transfer),
            }
        }
    }

    fn pass(
        &mut self,
        dispatches: &[Bound],
        repetitions: u32,
        timestamp_writes: Option<wgpu::ComputePassTimestampWrites<'_>>,
    ) {
        let mut pass = self
            .encoder
            .begin_compute_pass(&wgpu::ComputePassDescriptor {
                label: None,
                timestamp_writes,
            });
        for _ in 0..repetitions {
            for dispatch in dispatches {
                pass.set_pipeline(&dispatch.pipeline);
                pass.set_bind_group(0, &dispatch.buffers, &[]);
                match &dispatch.groups {
                    BoundGroups::Direct([x, y, z]) => pass.dispatch_workgroups(*x, *y, *z),
                    BoundGroups::Indirect(buffer, offset) => {
                        pass.dispatch_workgroups_indirect(buffer, *offset);
                    }
                }
            }
        }
    }

    /// Any step that is no pass.
    fn transfer(&mut self, step: &Step) {
        let encoder = &mut self.encoder;
        match step {
            Step::Copy { from, to, bytes } => {
                encoder.copy_buffer_to_buffer(from, 0, to, 0, *bytes);
            }
            Step::Clear(buffer) => encoder.clear_buffer(buffer, 0, None),
            Step::Download {
                from,
                first,
                at,
                bytes,
            } => {
                if let Some(results) = self.results {
                    encoder.copy_buffer_to_buffer(from, *first, results, *at, *bytes);
                }
            }
            Step::Pass(_) => {}
        }
    }

    /// The clock, if this is what it times.
    fn clock_for(&self, timing: Timing) -> Option<&'a Clock> {
        self.clock.filter(|clock| clock.timing == timing)
    }
}
