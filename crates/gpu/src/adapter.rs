//! Which adapter: by kind, by number, by name, or the best there is.

use std::fmt;

use crate::error::Error;

/// The environment variable that chooses an adapter where the program does not: `discrete`,
/// `integrated`, `software`, a number in the order of [`adapters`], or part of a name; in capitals
/// or not.
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
    /// The one at this place of [`adapters`], from 0.
    Number(usize),
    /// The first whose name contains this, whatever the case.
    Named(String),
}

impl AdapterChoice {
    /// Understands the values of [`ADAPTER_VARIABLE`]. One or two digits are a number; more are part
    /// of a name.
    #[must_use]
    pub fn parse(text: &str) -> Self {
        let text = text.trim();
        match text.to_lowercase().as_str() {
            "" | "auto" => Self::Auto,
            "discrete" => Self::Discrete,
            "integrated" => Self::Integrated,
            "software" => Self::Software,
            short if short.len() <= 2 => match short.parse() {
                Ok(number) => Self::Number(number),
                Err(_) => Self::Named(text.to_owned()),
            },
            _ => Self::Named(text.to_owned()),
        }
    }

    /// Whether the adapter at this place is meant.
    fn accepts(&self, place: usize, info: &wgpu::AdapterInfo) -> bool {
        match self {
            Self::Auto => true,
            Self::Discrete => info.device_type == wgpu::DeviceType::DiscreteGpu,
            Self::Integrated => info.device_type == wgpu::DeviceType::IntegratedGpu,
            Self::Software => info.device_type == wgpu::DeviceType::Cpu,
            Self::Number(number) => place == *number,
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
            Self::Number(number) => write!(f, " with the number {number}"),
            Self::Named(part) => write!(f, " whose name contains `{part}`"),
        }
    }
}

/// One adapter and no other: what it is, and its place among those that are the same.
#[derive(Clone, Debug)]
pub(crate) struct Identity {
    info: wgpu::AdapterInfo,
    among_equals: usize,
}

impl Identity {
    fn new(all: &[wgpu::AdapterInfo], place: usize) -> Option<Self> {
        let info = all.get(place)?;
        let before = all[..place].iter().filter(|other| same(other, info));
        Some(Self {
            info: info.clone(),
            among_equals: before.count(),
        })
    }

    /// Its place among the adapters there are now.
    fn place(&self, all: &[wgpu::AdapterInfo]) -> Option<usize> {
        let equal = |place: &usize| same(&all[*place], &self.info);
        (0..all.len()).filter(equal).nth(self.among_equals)
    }
}

impl fmt::Display for Identity {
    /// As the end of "no adapter".
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let info = &self.info;
        write!(
            f,
            " `{}` ({:?} {})",
            info.name, info.backend, info.device_pci_bus_id
        )?;
        f.write_str(", which was there before")
    }
}

/// Whether two adapters are the same one, or two of a kind that nothing tells apart.
fn same(a: &wgpu::AdapterInfo, b: &wgpu::AdapterInfo) -> bool {
    let key = |info: &wgpu::AdapterInfo| {
        (
            info.backend,
            info.vendor,
            info.device,
            info.device_pci_bus_id.clone(),
            info.name.clone(),
        )
    };
    key(a) == key(b)
}

/// The adapters of this machine, most capable kind first.
#[must_use]
pub fn adapters() -> Vec<wgpu::AdapterInfo> {
    infos(&enumerate(wgpu::MemoryBudgetThresholds::default()))
}

/// Whether tests of a GPU are to be left out here: there is no adapter, and the variable `CI` is not
/// set, or is empty. Where it is set everything must run.
#[must_use]
pub fn tests_are_left_out() -> bool {
    std::env::var_os("CI").is_none_or(|value| value.is_empty()) && adapters().is_empty()
}

/// The adapter that is meant.
pub(crate) fn choose(
    choice: &AdapterChoice,
    memory: wgpu::MemoryBudgetThresholds,
) -> Result<(wgpu::Adapter, Identity), Error> {
    let from_environment = || {
        let value = std::env::var(ADAPTER_VARIABLE).unwrap_or_default();
        AdapterChoice::parse(&value)
    };
    let choice = match choice {
        AdapterChoice::Auto => from_environment(),
        other => other.clone(),
    };
    let mut all = enumerate(memory);
    let infos = infos(&all);
    let mut places = infos.iter().enumerate();
    let place = places.position(|(place, info)| choice.accepts(place, info));
    let identity = place.and_then(|place| Some((place, Identity::new(&infos, place)?)));
    match identity {
        Some((place, identity)) => Ok((all.swap_remove(place), identity)),
        None => Err(no_adapter(&choice, &infos)),
    }
}

/// The adapter that was chosen before.
pub(crate) fn find(
    identity: &Identity,
    memory: wgpu::MemoryBudgetThresholds,
) -> Result<wgpu::Adapter, Error> {
    let mut all = enumerate(memory);
    let infos = infos(&all);
    match identity.place(&infos) {
        Some(place) => Ok(all.swap_remove(place)),
        None => Err(no_adapter(identity, &infos)),
    }
}

fn no_adapter(wanted: &impl fmt::Display, all: &[wgpu::AdapterInfo]) -> Error {
    let numbered = all.iter().enumerate();
    let found = numbered.map(|(number, info)| format!("{number}: {}", info.name));
    let found = found.collect::<Vec<_>>().join(", ");
    Error::NoAdapter {
        wanted: wanted.to_string(),
        found: if found.is_empty() {
            "none".to_owned()
        } else {
            found
        },
    }
}

fn infos(all: &[wgpu::Adapter]) -> Vec<wgpu::AdapterInfo> {
    all.iter().map(wgpu::Adapter::get_info).collect()
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
        for (text, choice) in [
            (" ", AdapterChoice::Auto),
            ("Auto", AdapterChoice::Auto),
            ("software", AdapterChoice::Software),
            ("SOFTWARE", AdapterChoice::Software),
            ("Discrete ", AdapterChoice::Discrete),
            ("0", AdapterChoice::Number(0)),
            ("12", AdapterChoice::Number(12)),
            ("4090", AdapterChoice::Named("4090".to_owned())),
            ("H1", AdapterChoice::Named("H1".to_owned())),
            ("Arc A770", AdapterChoice::Named("Arc A770".to_owned())),
        ] {
            assert_eq!(AdapterChoice::parse(text), choice, "{text}");
        }
    }

    fn gpu(name: &str, bus: &str) -> wgpu::AdapterInfo {
        let kind = wgpu::DeviceType::DiscreteGpu;
        let mut info = wgpu::AdapterInfo::new(kind, wgpu::Backend::Vulkan);
        info.name = name.to_owned();
        info.device_pci_bus_id = bus.to_owned();
        info
    }

    #[test]
    fn numbers_and_parts_of_names_choose() {
        let [first, second] = [gpu("Small A10", ""), gpu("Large H100", "")];
        let number = AdapterChoice::Number(1);
        assert!(!number.accepts(0, &first) && number.accepts(1, &second));
        let named = AdapterChoice::Named("h100".to_owned());
        assert!(!named.accepts(0, &first) && named.accepts(1, &second));
    }

    /// Of equal cards the same one is found, by its place on the bus, or by its number where none is
    /// told; one that is gone is not replaced by another.
    #[test]
    fn an_adapter_is_found_again_among_its_like() {
        let cards = [gpu("A", "1"), gpu("A", "2"), gpu("B", "3")];
        let second = Identity::new(&cards, 1).unwrap();
        assert_eq!(second.place(&cards), Some(1));
        assert_eq!(second.place(&cards[1..]), Some(0));
        assert_eq!(second.place(&[gpu("A", "1"), gpu("B", "3")]), None);
        let twins = [gpu("B", ""), gpu("A", ""), gpu("A", "")];
        let last = Identity::new(&twins, 2).unwrap();
        assert_eq!(last.place(&twins), Some(2));
        assert_eq!(last.place(&twins[..2]), None);
        let Error::NoAdapter { wanted, found } = no_adapter(&second, &cards[2..]) else {
            unreachable!()
        };
        assert_eq!(wanted, " `A` (Vulkan 2), which was there before");
        assert_eq!(found, "0: B");
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
