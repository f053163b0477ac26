//! Which adapter: by kind, by name, or the best there is.

use std::fmt;

use crate::error::Error;

/// The environment variable that chooses an adapter where the program does not: `discrete`,
/// `integrated`, `software`, or part of a name.
pub const ADAPTER_VARIABLE: &str = "VERTEBRA_ADAPTER";

/// Which adapter to open.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum AdapterChoice {
    /// What [`ADAPTER_VARIABLE`] says; without it the most capable kind there is.
    #[default]
    Auto,
    /// A GPU with memory of its own.
    Discrete,
    /// A GPU that shares the processor's memory.
    Integrated,
    /// The processor, through a software driver such as lavapipe or WARP.
    Software,
    /// The first whose name contains this, whatever the case.
    Named(String),
}

impl AdapterChoice {
    /// Understands the values of [`ADAPTER_VARIABLE`].
    #[must_use]
    pub fn parse(text: &str) -> Self {
        match text.trim() {
            "" | "auto" => Self::Auto,
            "discrete" => Self::Discrete,
            "integrated" => Self::Integrated,
            "software" => Self::Software,
            name => Self::Named(name.to_owned()),
        }
    }

    /// Whether an adapter is meant.
    fn accepts(&self, info: &wgpu::AdapterInfo) -> bool {
        match self {
            Self::Auto => true,
            Self::Discrete => info.device_type == wgpu::DeviceType::DiscreteGpu,
            Self::Integrated => info.device_type == wgpu::DeviceType::IntegratedGpu,
            Self::Software => info.device_type == wgpu::DeviceType::Cpu,
            Self::Named(part) => info.name.to_lowercase().contains(&part.to_lowercase()),
        }
    }
}

impl fmt::Display for AdapterChoice {
    /// As the end of "no adapter".
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Auto => Ok(()),
            Self::Discrete => f.write_str(" that is discrete"),
            Self::Integrated => f.write_str(" that is integrated"),
            Self::Software => f.write_str(" that is software"),
            Self::Named(part) => write!(f, " whose name contains `{part}`"),
        }
    }
}

/// The adapters of this machine, most capable kind first.
#[must_use]
pub fn adapters() -> Vec<wgpu::AdapterInfo> {
    let all = enumerate(wgpu::MemoryBudgetThresholds::default());
    all.iter().map(wgpu::Adapter::get_info).collect()
}

/// The adapter that is meant.
pub(crate) fn choose(
    choice: &AdapterChoice,
    memory: wgpu::MemoryBudgetThresholds,
) -> Result<wgpu::Adapter, Error> {
    let from_environment = || {
        let value = std::env::var(ADAPTER_VARIABLE).unwrap_or_default();
        AdapterChoice::parse(&value)
    };
    let choice = match choice {
        AdapterChoice::Auto => from_environment(),
        other => other.clone(),
    };
    let all = enumerate(memory);
    let found = all.iter().map(|adapter| adapter.get_info().name);
    let found = found.collect::<Vec<_>>().join(", ");
    all.into_iter()
        .find(|adapter| choice.accepts(&adapter.get_info()))
        .ok_or_else(|| Error::NoAdapter {
            wanted: choice.to_string(),
            found: if found.is_empty() {
                "none".to_owned()
            } else {
                found
            },
        })
}

fn enumerate(memory: wgpu::MemoryBudgetThresholds) -> Vec<wgpu::Adapter> {
    let backends = wgpu::Backends::PRIMARY & wgpu::Instance::enabled_backend_features();
    // An instance without backends panics.
    if backends.is_empty() {
        return Vec::new();
    }
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
        backends,
        memory_budget_thresholds: memory,
        ..wgpu::InstanceDescriptor::new_without_display_handle()
    });
    let mut adapters = pollster::block_on(instance.enumerate_adapters(backends));
    adapters.sort_by_key(|adapter| rank(adapter.get_info().device_type));
    adapters
}

fn rank(kind: wgpu::DeviceType) -> u32 {
    match kind {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_of_the_environment_are_understood() {
        assert_eq!(AdapterChoice::parse(" "), AdapterChoice::Auto);
        assert_eq!(AdapterChoice::parse("software"), AdapterChoice::Software);
        let named = AdapterChoice::parse("H100");
        assert_eq!(named, AdapterChoice::Named("H100".to_owned()));
    }

    #[test]
    fn an_adapter_that_is_not_there_is_named_beside_those_that_are() {
        let choice = AdapterChoice::Named("no such adapter".to_owned());
        let error = choose(&choice, wgpu::MemoryBudgetThresholds::default()).unwrap_err();
        let text = error.to_string();
        assert!(
            matches!(error, Error::NoAdapter { .. })
                && text.contains("no such adapter")
                && text.contains("found: "),
            "{text}"
        );
    }
}
