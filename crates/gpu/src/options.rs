//! What is asked of a device.

use crate::adapter::AdapterChoice;
use crate::error::Shortfall;

/// What is asked of a device.
#[derive(Clone, Debug)]
pub struct Options {
    /// Which adapter.
    pub adapter: AdapterChoice,
    /// Features without which the device is useless.
    pub required: wgpu::Features,
    /// Features to take where the adapter has them.
    pub wanted: wgpu::Features,
    /// Limits below which the device is useless.
    pub limits: wgpu::Limits,
    /// Whether to open the device with exactly these limits, to see that they suffice, instead of
    /// the best the adapter has.
    pub exact_limits: bool,
    /// Part of the device's memory budget beyond which allocations are refused \[percent\]; where the
    /// driver tells the budget.
    pub memory_percent: Option<u8>,
}

impl Default for Options {
    /// Any adapter with eight storage buffers a shader; f64, subgroups and timestamps where it has
    /// them.
    fn default() -> Self {
        Self {
            adapter: AdapterChoice::Auto,
            required: wgpu::Features::empty(),
            wanted: wgpu::Features::SHADER_F64
                | wgpu::Features::SUBGROUP
                | wgpu::Features::TIMESTAMP_QUERY,
            limits: wgpu::Limits {
                max_storage_buffers_per_shader_stage: 8,
                ..wgpu::Limits::downlevel_defaults()
            },
            exact_limits: false,
            memory_percent: None,
        }
    }
}

impl Options {
    /// Everything in which an adapter falls short of them.
    pub(crate) fn missing(
        &self,
        features: wgpu::Features,
        available: &wgpu::Limits,
    ) -> Vec<Shortfall> {
        let lacking = self.required - features;
        let mut missing: Vec<Shortfall> = lacking
            .iter_names()
            .map(|(name, _)| Shortfall::Feature(name.to_owned()))
            .collect();
        let note = |limit, needed, available| {
            missing.push(Shortfall::Limit {
                limit,
                needed,
                available,
            });
        };
        self.limits
            .check_limits_with_fail_fn(available, false, note);
        missing
    }

    /// How full the device's memory may be.
    pub(crate) fn memory(&self) -> wgpu::MemoryBudgetThresholds {
        wgpu::MemoryBudgetThresholds {
            for_resource_creation: self.memory_percent,
            for_device_loss: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Error;

    #[test]
    fn every_shortfall_is_named_at_once() {
        let options = Options {
            required: wgpu::Features::SHADER_F64 | wgpu::Features::SUBGROUP,
            limits: wgpu::Limits {
                max_compute_workgroup_size_x: 1024,
                max_storage_buffers_per_shader_stage: 12,
                ..wgpu::Limits::downlevel_defaults()
            },
            ..Options::default()
        };
        let adapter = wgpu::Limits::downlevel_defaults();
        let missing = options.missing(wgpu::Features::SUBGROUP, &adapter);
        let error = Error::Unsupported {
            adapter: "Small GPU".to_owned(),
            missing,
        };
        assert_eq!(
            error.to_string(),
            "Small GPU lacks SHADER_F64; max_storage_buffers_per_shader_stage = 12 (it has 4); \
             max_compute_workgroup_size_x = 1024 (it has 256); ask for less, or choose another adapter"
        );
    }
}
