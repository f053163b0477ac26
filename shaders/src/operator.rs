//! What scans and reductions combine elements with.

use std::mem::size_of;

use bytemuck::Pod;
use vertebra_gpu::Kernel;
use vertebra_gpu::wgpu::Features;

use crate::kernels::THREADS;

/// Precision of the floating-point numbers of a kernel: `alias real`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// Single.
    F32,
    /// Double; needs `SHADER_F64`.
    F64,
}

impl Precision {
    /// The part that defines `real` and `is_finite`.
    #[must_use]
    pub fn part(self) -> &'static str {
        match self {
            Self::F32 => include_str!("../wgsl/shared/real_f32.wgsl"),
            Self::F64 => include_str!("../wgsl/shared/real_f64.wgsl"),
        }
    }

    /// Features of the device that it needs.
    #[must_use]
    pub fn features(self) -> Features {
        match self {
            Self::F32 => Features::empty(),
            Self::F64 => Features::SHADER_F64,
        }
    }

    /// Size of a number \[byte\].
    #[must_use]
    pub fn bytes(self) -> u32 {
        match self {
            Self::F32 => 4,
            Self::F64 => 8,
        }
    }
}

/// An associative operation on elements of one type, for [`Scan`](crate::Scan) and
/// [`Reduce`](crate::Reduce).
///
/// Its WGSL defines `alias Element`, `fn identity() -> Element` and
/// `fn combine(a: Element, b: Element) -> Element`. It need not commute: order is kept.
///
/// ```
/// use vertebra_shaders::{Operator, Precision, Scan};
/// // The maps x -> a x + b; the first map first.
/// let maps = Operator::new::<[f64; 2]>(
///     "alias Element = vec2<real>;
///      fn identity() -> Element { return Element(1, 0); }
///      fn combine(f: Element, g: Element) -> Element {
///          return Element(g.x * f.x, g.x * f.y + g.y);
///      }",
/// );
/// let scan = Scan::new(&maps.in_precision(Precision::F64));
/// # _ = scan;
/// ```
#[derive(Clone, Debug)]
pub struct Operator {
    parts: Vec<&'static str>,
    bytes: u32,
    features: Features,
}

impl Operator {
    /// An operation on elements that the host knows as `T`: buffers of elements of another size are
    /// refused.
    #[must_use]
    #[expect(
        clippy::cast_possible_truncation,
        reason = "no element is larger than 4 GiB"
    )]
    pub fn new<T: Pod>(wgsl: &'static str) -> Self {
        Self {
            parts: vec![wgsl],
            bytes: size_of::<T>() as u32,
            features: Features::empty(),
        }
    }

    /// Adds a part of WGSL that the operation uses.
    #[must_use]
    pub fn with(mut self, part: &'static str) -> Self {
        self.parts.push(part);
        self
    }

    /// Says which features of the device it uses.
    #[must_use]
    pub fn requires(mut self, features: Features) -> Self {
        self.features |= features;
        self
    }

    /// Gives its `real` a precision, and asks for the feature that this needs.
    #[must_use]
    pub fn in_precision(self, precision: Precision) -> Self {
        self.with(precision.part()).requires(precision.features())
    }

    /// Sums of words, modulo 2^32.
    #[must_use]
    pub fn add_u32() -> Self {
        Self::new::<u32>(include_str!("../wgsl/shared/add_u32.wgsl"))
    }

    /// Sums of numbers.
    #[must_use]
    pub fn add(precision: Precision) -> Self {
        let mut operator = Self::new::<f32>(include_str!("../wgsl/shared/add_real.wgsl"));
        operator.bytes = precision.bytes();
        operator.in_precision(precision)
    }

    /// Adds the operation to a kernel that is written for any, whose bindings `elements` hold
    /// elements.
    pub(crate) fn complete(&self, kernel: &Kernel, elements: &[&str]) -> Kernel {
        let mut kernel = kernel.clone().requires(self.features);
        for &part in &self.parts {
            kernel = kernel.with(part);
        }
        for binding in elements {
            kernel = kernel.stride(binding, self.bytes);
        }
        kernel.workgroup_memory_of(THREADS * self.bytes)
    }
}
