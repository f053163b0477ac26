//! Named arrays of numbers, and how files keep every bit of them.

use std::fmt::Write as _;
use std::num::ParseIntError;

use serde::{Deserialize, Serialize};

/// A named array of numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Digits", into = "Digits")]
pub struct Named {
    /// Its name.
    pub name: String,
    /// Its elements.
    pub values: Values,
}

impl Named {
    /// Names an array.
    pub fn new(name: &str, values: impl Into<Values>) -> Self {
        Self {
            name: name.to_owned(),
            values: values.into(),
        }
    }
}

/// An array of one of the types that kernels compute with.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Values {
    /// Words.
    U32(Vec<u32>),
    /// Single precision.
    F32(Vec<f32>),
    /// Double precision.
    F64(Vec<f64>),
}

impl From<Vec<u32>> for Values {
    fn from(values: Vec<u32>) -> Self {
        Self::U32(values)
    }
}

impl From<Vec<f32>> for Values {
    fn from(values: Vec<f32>) -> Self {
        Self::F32(values)
    }
}

impl From<Vec<f64>> for Values {
    fn from(values: Vec<f64>) -> Self {
        Self::F64(values)
    }
}

impl Values {
    /// Number of elements.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Self::U32(values) => values.len(),
            Self::F32(values) => values.len(),
            Self::F64(values) => values.len(),
        }
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// An element as a number; none beyond the end.
    #[must_use]
    pub fn get(&self, index: usize) -> Option<f64> {
        match self {
            Self::U32(values) => values.get(index).map(|&value| value.into()),
            Self::F32(values) => values.get(index).map(|&value| value.into()),
            Self::F64(values) => values.get(index).copied(),
        }
    }

    /// The words of a `u32` array; none of another type's.
    #[must_use]
    pub fn words(&self) -> &[u32] {
        match self {
            Self::U32(values) => values,
            _ => &[],
        }
    }

    /// Whether both have the same bits: unlike `==`, for which a NaN is never its like.
    #[must_use]
    pub fn has_bits_of(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::U32(a), Self::U32(b)) => a == b,
            (Self::F32(a), Self::F32(b)) => {
                bytemuck::cast_slice::<_, u8>(a) == bytemuck::cast_slice::<_, u8>(b)
            }
            (Self::F64(a), Self::F64(b)) => {
                bytemuck::cast_slice::<_, u8>(a) == bytemuck::cast_slice::<_, u8>(b)
            }
            _ => false,
        }
    }
}

/// A named array in a file.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Digits {
    name: String,
    r#type: Type,
    /// Hexadecimal digits of the elements, 8 or 16 each.
    bits: String,
}

#[derive(Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Type {
    U32,
    F32,
    F64,
}

impl From<Named> for Digits {
    fn from(named: Named) -> Self {
        fn digits<B: std::fmt::LowerHex>(bits: impl Iterator<Item = B>) -> String {
            let mut text = String::new();
            let width = 2 * size_of::<B>();
            bits.for_each(|bits| _ = write!(text, "{bits:0width$x}"));
            text
        }
        let (r#type, bits) = match named.values {
            Values::U32(values) => (Type::U32, digits(values.into_iter())),
            Values::F32(values) => (Type::F32, digits(values.into_iter().map(f32::to_bits))),
            Values::F64(values) => (Type::F64, digits(values.into_iter().map(f64::to_bits))),
        };
        Self {
            name: named.name,
            r#type,
            bits,
        }
    }
}

impl TryFrom<Digits> for Named {
    type Error = String;

    fn try_from(Digits { name, r#type, bits }: Digits) -> Result<Self, String> {
        let word = |digits: &str| u32::from_str_radix(digits, 16);
        let double = |digits: &str| u64::from_str_radix(digits, 16);
        let values = match r#type {
            Type::U32 => elements(&bits, word).map(Values::U32),
            Type::F32 => elements(&bits, |d| word(d).map(f32::from_bits)).map(Values::F32),
            Type::F64 => elements(&bits, |d| double(d).map(f64::from_bits)).map(Values::F64),
        };
        match values {
            Ok(values) => Ok(Self { name, values }),
            Err(reason) => Err(format!("array `{name}`: {reason}")),
        }
    }
}

/// Elements of equally many digits.
fn elements<T>(
    bits: &str,
    read: impl Fn(&str) -> Result<T, ParseIntError>,
) -> Result<Vec<T>, String> {
    let width = 2 * size_of::<T>();
    if !bits.bytes().all(|digit| digit.is_ascii_hexdigit()) {
        return Err("not hexadecimal".to_owned());
    }
    if !bits.len().is_multiple_of(width) {
        return Err(format!(
            "{} hexadecimal digits are no whole number of elements of {width}",
            bits.len()
        ));
    }
    let starts = (0..bits.len()).step_by(width);
    let element = |at| read(&bits[at..at + width]).map_err(|error| error.to_string());
    starts.map(element).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_keep_every_bit() {
        let arrays = [
            Named::new("words", vec![0_u32, 7, u32::MAX]),
            Named::new("singles", vec![1.5_f32, -0.0, f32::from_bits(0x7fc0_0001)]),
            Named::new("doubles", vec![f64::MAX, f64::NEG_INFINITY, 5e-324]),
            Named::new("nothing", Vec::<f64>::new()),
        ];
        for named in arrays {
            let text = serde_json::to_string(&named).unwrap();
            let read: Named = serde_json::from_str(&text).unwrap();
            assert_eq!(read.name, named.name);
            assert!(read.values.has_bits_of(&named.values), "{text}");
        }
    }

    #[test]
    fn what_is_no_array_is_refused_by_name() {
        let refusal = |kind: &str, bits: &str| {
            let text = format!(r#"{{"name":"data","type":"{kind}","bits":"{bits}"}}"#);
            serde_json::from_str::<Named>(&text)
                .unwrap_err()
                .to_string()
        };
        assert!(refusal("i8", "").contains("i8"));
        assert!(refusal("u32", "123").contains("array `data`: 3 hexadecimal digits"));
        assert!(refusal("u32", "0000000g").contains("not hexadecimal"));
        // What `from_str_radix` would take.
        assert!(refusal("u32", "+0000001").contains("not hexadecimal"));
    }
}
