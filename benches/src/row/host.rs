//! The machine that measures.

use std::fs;

/// What a row says about the machine it was measured on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Host {
    /// Model name of the processor, `"unknown"` where the system does not tell.
    pub device: String,
    /// Operating system and architecture, such as `"linux x86_64"`.
    pub os: String,
}

impl Host {
    /// The machine this process runs on.
    #[must_use]
    pub fn detect() -> Self {
        let cpuinfo = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
        Self {
            device: model_name(&cpuinfo).unwrap_or("unknown").to_owned(),
            os: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
        }
    }
}

/// The processor's name in the text of `/proc/cpuinfo`: `model name` on x86, `Model` on many ARM
/// boards.
fn model_name(cpuinfo: &str) -> Option<&str> {
    let value = |key: &str| {
        cpuinfo.lines().find_map(|line| {
            let (name, value) = line.split_once(':')?;
            (name.trim() == key && !value.trim().is_empty()).then(|| value.trim())
        })
    };
    value("model name").or_else(|| value("Model"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_processor_is_named_where_the_system_tells() {
        let x86 = "processor\t: 0\nvendor_id\t: X\nmodel name\t: Some CPU @ 2.00GHz\n\nmodel name\t: other\n";
        assert_eq!(model_name(x86), Some("Some CPU @ 2.00GHz"));
        assert_eq!(
            model_name("processor\t: 0\n\nModel\t\t: Board Rev 1.4\n"),
            Some("Board Rev 1.4")
        );
        assert_eq!(model_name("model name\t:\n"), None);
        assert!(!Host::detect().device.is_empty());
    }
}
