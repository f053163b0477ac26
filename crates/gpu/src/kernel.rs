//! Kernels: WGSL by name, its bindings listed once.

use std::borrow::Cow;
use std::hash::{Hash, Hasher};

/// How a kernel uses a binding.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Access {
    /// `var<uniform>`: one small struct, the same for all.
    Uniform,
    /// `var<storage, read>`
    Read,
    /// `var<storage, read_write>`
    ReadWrite,
}

/// One binding of a kernel; its place in the list is its number in group 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Binding {
    /// Name of the variable in WGSL.
    pub name: &'static str,
    /// What the kernel does with it.
    pub access: Access,
    /// Size of the struct, or of one element of the array \[byte\].
    pub stride: u32,
}

impl Binding {
    /// A uniform struct.
    #[must_use]
    pub const fn uniform<T>(name: &'static str) -> Self {
        Self::new::<T>(name, Access::Uniform)
    }

    /// An array that is only read.
    #[must_use]
    pub const fn read<T>(name: &'static str) -> Self {
        Self::new::<T>(name, Access::Read)
    }

    /// An array that is read and written.
    #[must_use]
    pub const fn read_write<T>(name: &'static str) -> Self {
        Self::new::<T>(name, Access::ReadWrite)
    }

    #[expect(
        clippy::cast_possible_truncation,
        reason = "no element is larger than 4 GiB"
    )]
    const fn new<T>(name: &'static str, access: Access) -> Self {
        Self {
            name,
            access,
            stride: size_of::<T>() as u32,
        }
    }
}

/// A compute shader: parts of WGSL joined in order, the entry point `main`, and its bindings.
///
/// WGSL lets declarations stand in any order, so that composing is joining: a template calls
/// `combine(a, b)`, and [`Kernel::with`] adds the part that says what it does.
///
/// Workgroup memory holds anything at first; a kernel sets what it reads.
///
/// ```
/// use vertebra_gpu::{Binding, Kernel};
/// const DOUBLE: Kernel = Kernel::new(
///     "double",
///     &["@group(0) @binding(0) var<storage, read_write> data: array<f32>;
///        @compute @workgroup_size(64)
///        fn main(@builtin(global_invocation_id) id: vec3<u32>) {
///            if id.x < arrayLength(&data) { data[id.x] *= 2.0; }
///        }"],
///     &[Binding::read_write::<f32>("data")],
///     [64, 1, 1],
/// );
/// assert_eq!(DOUBLE.bindings()[0].stride, 4);
/// ```
#[derive(Clone, Debug)]
pub struct Kernel {
    name: Cow<'static, str>,
    parts: Cow<'static, [&'static str]>,
    bindings: Cow<'static, [Binding]>,
    workgroup_size: [u32; 3],
    workgroup_memory: u32,
    features: wgpu::Features,
    constants: Vec<(&'static str, f64)>,
}

impl Kernel {
    /// A kernel named like its file.
    #[must_use]
    pub const fn new(
        name: &'static str,
        parts: &'static [&'static str],
        bindings: &'static [Binding],
        workgroup_size: [u32; 3],
    ) -> Self {
        Self {
            name: Cow::Borrowed(name),
            parts: Cow::Borrowed(parts),
            bindings: Cow::Borrowed(bindings),
            workgroup_size,
            workgroup_memory: 0,
            features: wgpu::Features::empty(),
            constants: Vec::new(),
        }
    }

    /// Says how much workgroup memory it declares \[byte\].
    #[must_use]
    pub const fn workgroup_memory_of(mut self, bytes: u32) -> Self {
        self.workgroup_memory = bytes;
        self
    }

    /// Says which features of the device it uses.
    #[must_use]
    pub const fn requires(mut self, features: wgpu::Features) -> Self {
        self.features = self.features.union(features);
        self
    }

    /// Adds a part of WGSL. A kernel is told from another by name, parts and constants together.
    #[must_use]
    pub fn with(mut self, part: &'static str) -> Self {
        self.parts.to_mut().push(part);
        self
    }

    /// Gives a WGSL `override` its value.
    #[must_use]
    pub fn constant(mut self, name: &'static str, value: impl Into<f64>) -> Self {
        self.constants.push((name, value.into()));
        self
    }

    /// Says the size of one element of a binding \[byte\], where an added part decides it.
    #[must_use]
    pub fn stride(mut self, binding: &str, bytes: u32) -> Self {
        for entry in self.bindings.to_mut() {
            if entry.name == binding {
                entry.stride = bytes;
            }
        }
        self
    }

    /// Its name.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Its bindings, in group 0, numbered from 0.
    #[must_use]
    pub fn bindings(&self) -> &[Binding] {
        &self.bindings
    }

    /// Invocations of a workgroup, as the shader's `@workgroup_size` says.
    #[must_use]
    pub fn workgroup_size(&self) -> [u32; 3] {
        self.workgroup_size
    }

    /// Workgroup memory it declares \[byte\].
    #[must_use]
    pub fn workgroup_memory(&self) -> u32 {
        self.workgroup_memory
    }

    /// Features it uses.
    #[must_use]
    pub fn features(&self) -> wgpu::Features {
        self.features
    }

    /// Values of its `override` constants.
    #[must_use]
    pub fn constants(&self) -> &[(&'static str, f64)] {
        &self.constants
    }

    /// Whether every loop is seen to end. Such a kernel is compiled as it is; loops of others get a
    /// counter that ends them after 2^64 rounds, which costs time: the sort of `vertebra-shaders`
    /// would take twice as long.
    ///
    /// Seen to end are `for (var i = start; i < bound; i += step)` with `i: u32`, which the body
    /// does not write; `step` is one, or `step` and `bound` are constants and `i` cannot wrap.
    #[must_use]
    pub fn loops_end(&self) -> bool {
        crate::loops::all_end(&self.source())
    }

    /// The whole shader.
    #[must_use]
    pub fn source(&self) -> String {
        self.parts.join("\n")
    }
}

impl PartialEq for Kernel {
    /// Whether both make the same pipeline: sources are compared, and constants by their bits.
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
            && self.parts == other.parts
            && self.bindings == other.bindings
            && constant_bits(self).eq(constant_bits(other))
    }
}

impl Eq for Kernel {}

impl Hash for Kernel {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.name.hash(state);
        self.parts.hash(state);
        constant_bits(self).for_each(|constant| constant.hash(state));
    }
}

fn constant_bits(kernel: &Kernel) -> impl Iterator<Item = (&'static str, u64)> {
    let constants = kernel.constants.iter();
    constants.map(|(name, value)| (*name, value.to_bits()))
}

/// The number of workgroups for `items` in groups of `per_group`, spread over two dimensions where
/// one is not enough. A kernel finds its number as `id.y * groups.x + id.x` of `workgroup_id` and
/// `num_workgroups`; numbers at and beyond `items / per_group` have nothing to do.
///
/// ```
/// use vertebra_gpu::workgroups;
/// assert_eq!(workgroups(1000, 256), [4, 1, 1]);
/// let [x, y, _] = workgroups(1 << 30, 256);
/// assert!(x <= 65_535 && u64::from(x) * u64::from(y) * 256 >= 1 << 30);
/// ```
#[must_use]
pub fn workgroups(items: u32, per_group: u32) -> [u32; 3] {
    const MOST: u32 = 65_535; // WebGPU's maxComputeWorkgroupsPerDimension
    let groups = items.div_ceil(per_group.max(1));
    let rows = groups.div_ceil(MOST).max(1);
    [groups.div_ceil(rows), rows, 1]
}
