//! Kernels: WGSL by name, its bindings listed once.

use std::borrow::Cow;
use std::hash::{Hash, Hasher};

use crate::STATUS;
use crate::error::Problem;
use crate::recording::Stage;

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
/// use vertebra_gpu::{Binding, ELEMENTS, Kernel};
/// const DOUBLE: Kernel = Kernel::new(
///     "double",
///     &["@group(0) @binding(0) var<storage, read_write> data: array<f32>;
///        @compute @workgroup_size(64)
///        fn main(
///            @builtin(global_invocation_id) id: vec3<u32>,
///            @builtin(num_workgroups) groups: vec3<u32>,
///        ) {
///            let i = element(id, groups, 64u);
///            if i < arrayLength(&data) { data[i] *= 2.0; }
///        }", ELEMENTS],
///     &[Binding::read_write::<f32>("data")],
///     [64, 1, 1],
/// );
/// assert_eq!(DOUBLE.differences(), []);
/// ```
#[derive(Clone, Debug)]
pub struct Kernel {
    name: Cow<'static, str>,
    parts: &'static [&'static str],
    added: Vec<Cow<'static, str>>,
    bindings: Cow<'static, [Binding]>,
    workgroup_size: [u32; 3],
    workgroup_memory: u32,
    features: wgpu::Features,
    constants: Vec<(Cow<'static, str>, f64)>,
    stage: Option<Stage>,
}

/// The value of a WGSL `override`: a number, or a [`Stage`].
#[derive(Clone, Copy, Debug)]
pub struct Constant {
    value: f64,
    stage: Option<Stage>,
}

impl<T: Into<f64>> From<T> for Constant {
    fn from(value: T) -> Self {
        Self {
            value: value.into(),
            stage: None,
        }
    }
}

impl From<Stage> for Constant {
    fn from(stage: Stage) -> Self {
        Self {
            value: stage.bit.into(),
            stage: Some(stage),
        }
    }
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
            parts,
            added: Vec::new(),
            bindings: Cow::Borrowed(bindings),
            workgroup_size,
            workgroup_memory: 0,
            features: wgpu::Features::empty(),
            constants: Vec::new(),
            stage: None,
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

    /// Gives it another name.
    #[must_use]
    pub fn named(mut self, name: impl Into<Cow<'static, str>>) -> Self {
        self.name = name.into();
        self
    }

    /// Adds a part of WGSL. A kernel is told from another by what it declares, parts and constants
    /// together.
    #[must_use]
    pub fn with(mut self, part: &'static str) -> Self {
        self.added.push(Cow::Borrowed(part));
        self
    }

    /// Adds a part of WGSL that is made at run time.
    #[must_use]
    pub fn with_text(mut self, part: String) -> Self {
        self.added.push(Cow::Owned(part));
        self
    }

    /// Gives a WGSL `override` its value, instead of one given before.
    #[must_use]
    pub fn constant(
        mut self,
        name: impl Into<Cow<'static, str>>,
        value: impl Into<Constant>,
    ) -> Self {
        let (name, Constant { value, stage }) = (name.into(), value.into());
        if name == "STAGE" {
            self.stage = stage;
        }
        self.constants.retain(|(given, _)| *given != name);
        self.constants.push((name, value));
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

    /// Names and values of its `override` constants.
    pub fn constants(&self) -> impl Iterator<Item = (&str, f64)> {
        let constants = self.constants.iter();
        constants.map(|(name, value)| (name.as_ref(), *value))
    }

    /// The stage whose failures it reports.
    pub(crate) fn stage(&self) -> Option<Stage> {
        self.stage
    }

    /// Whether it has the part with which failures are reported, by itself or in a longer one.
    pub(crate) fn can_fail(&self) -> bool {
        self.parts().any(|part| part.contains(STATUS))
    }

    /// Whether every loop is seen to end. Such a kernel is compiled as it is; loops of others get a
    /// counter that ends them after 2^64 rounds, which costs time: the sort of `vertebra-shaders`
    /// would take twice as long.
    ///
    /// Seen to end are `for (var i = start; i < bound; i += step)` with `i: u32`, which the body
    /// does not write; `step` is one, or `step` and `bound` are constants and `i` cannot wrap.
    #[must_use]
    pub fn loops_end(&self) -> bool {
        let module = naga::front::wgsl::parse_str(&self.source());
        module.is_ok_and(|module| crate::loops::all_end(&module))
    }

    /// All in which the shader differs from what is declared of it: entry point, workgroup size and
    /// memory, bindings, and an `override STAGE` that is not the one of [`STATUS`]. Workgroup memory
    /// whose size cannot be told, because an `override` computes it, is not compared. None of a
    /// shader that does not compile. No GPU is needed;
    /// [`Device::prepare`](crate::Device::prepare) looks at each kernel once.
    #[must_use]
    pub fn differences(&self) -> Vec<Problem> {
        let module = naga::front::wgsl::parse_str(&self.source());
        module.map_or_else(
            |_| Vec::new(),
            |module| crate::reflect::differences(self, &module),
        )
    }

    /// The whole shader.
    #[must_use]
    pub fn source(&self) -> String {
        self.parts().collect::<Vec<_>>().join("\n")
    }

    fn parts(&self) -> impl Iterator<Item = &str> {
        let added = self.added.iter().map(AsRef::as_ref);
        self.parts.iter().copied().chain(added)
    }

    fn constant_bits(&self) -> impl Iterator<Item = (&str, u64)> {
        self.constants()
            .map(|(name, value)| (name, value.to_bits()))
    }
}

impl PartialEq for Kernel {
    /// Whether both are declared alike and make the same pipeline: sources are compared, and
    /// constants by their bits.
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
            && self.parts().eq(other.parts())
            && self.bindings == other.bindings
            && self.workgroup_size == other.workgroup_size
            && self.workgroup_memory == other.workgroup_memory
            && self.constant_bits().eq(other.constant_bits())
    }
}

impl Eq for Kernel {}

impl Hash for Kernel {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.name.hash(state);
        self.parts().for_each(|part| part.hash(state));
        self.constant_bits()
            .for_each(|constant| constant.hash(state));
    }
}
