//! What a shader says of itself, compared with what its kernel declares.
//!
//! wgpu refuses a binding that does not fit, but takes any workgroup size; a kernel that declares
//! another than its shader has would be dispatched with too many or too few workgroups.

use std::collections::BTreeMap;

use naga::{
    AddressSpace, ArraySize, EntryPoint, Expression, Handle, Literal, Module, Override,
    ResourceBinding, Scalar, ShaderStage, StorageAccess, TypeInner,
};

use crate::error::Problem;
use crate::kernel::{Access, Kernel};

/// All in which a shader differs from its kernel.
pub(crate) fn differences(kernel: &Kernel, module: &Module) -> Vec<Problem> {
    let mut compared = Compared {
        kernel,
        problems: Vec::new(),
    };
    let entry_points = || module.entry_points.iter();
    let is_main = |e: &&EntryPoint| e.name == "main" && e.stage == ShaderStage::Compute;
    if let Some(main) = entry_points().find(is_main) {
        let declared = format!("{:?}", kernel.workgroup_size());
        let found = format!("{:?}", workgroup_size(kernel, module, main));
        compared.note("the workgroup size", declared, found);
    } else {
        let names: Vec<_> = entry_points().map(|e| e.name.as_str()).collect();
        compared.note("the entry point", "main".to_owned(), names.join(", "));
    }
    let has_stage = |(_, declared): (_, &Override)| declared.name.as_deref() == Some("STAGE");
    if !kernel.can_fail() && module.overrides.iter().any(has_stage) {
        // Its failures would go to the first stage, whichever that is.
        let (what, declared) = ("`override STAGE`", "that of the part `STATUS`");
        compared.note(what, declared.to_owned(), "another".to_owned());
    }
    compared.variables(module);
    compared.problems
}

struct Compared<'a> {
    kernel: &'a Kernel,
    problems: Vec<Problem>,
}

impl Compared<'_> {
    fn note(&mut self, what: &str, declared: String, found: String) {
        if declared != found {
            self.problems.push(Problem::Kernel {
                kernel: self.kernel.name().to_owned(),
                what: what.to_owned(),
                declared,
                found,
            });
        }
    }

    fn declared_stride(&self, place: &ResourceBinding) -> Option<u32> {
        let binding = self.kernel.bindings().get(place.binding as usize);
        binding.map(|binding| binding.stride)
    }

    /// Bindings and workgroup memory.
    fn variables(&mut self, module: &Module) {
        let mut layouts = naga::proc::Layouter::default();
        if layouts.update(module.to_ctx()).is_err() {
            // Something too large to be counted, which the compiler refuses.
            return;
        }
        const NOTHING: &str = "nothing";
        let declared = (0..).zip(self.kernel.bindings()).map(|(number, binding)| {
            let text = describe(binding.name, access_name(binding.access), binding.stride);
            ((0, number), text)
        });
        let mut declared: BTreeMap<(u32, u32), String> = declared.collect();
        // None if it cannot be told.
        let mut workgroup_memory = Some(0_u32);
        for (_, variable) in module.global_variables.iter() {
            let size = layouts[variable.ty].size;
            if variable.space == AddressSpace::WorkGroup {
                // An array that an `override` sizes is as long as the kernel's constants say.
                let size = match module.types[variable.ty].inner {
                    TypeInner::Array {
                        size: ArraySize::Pending(count),
                        stride,
                        ..
                    } => {
                        let count = overridden(self.kernel, module, count);
                        count.map(|count| count.saturating_mul(stride))
                    }
                    _ => Some(size),
                };
                let sum = workgroup_memory.zip(size);
                workgroup_memory = sum.map(|(sum, size)| sum.saturating_add(size));
            }
            let Some(place) = &variable.binding else {
                continue;
            };
            let access = match variable.space {
                AddressSpace::Uniform => access_name(Access::Uniform),
                AddressSpace::Storage { access } if access.contains(StorageAccess::STORE) => {
                    access_name(Access::ReadWrite)
                }
                AddressSpace::Storage { .. } => access_name(Access::Read),
                _ => "no buffer",
            };
            let stride = match module.types[variable.ty].inner {
                TypeInner::Array { base, stride, .. } => {
                    let is_word = module.types[base].inner.scalar() == Some(Scalar::U32);
                    // Words may be parts of larger elements.
                    let larger = self
                        .declared_stride(place)
                        .filter(|_| is_word && stride == 4);
                    larger.filter(|d| d.is_multiple_of(4)).unwrap_or(stride)
                }
                _ => size,
            };
            let name = variable.name.as_deref().unwrap_or_default();
            let found = describe(name, access, stride);
            let declared = declared.remove(&(place.group, place.binding));
            self.note(
                &format!("@group({}) @binding({})", place.group, place.binding),
                declared.unwrap_or_else(|| NOTHING.to_owned()),
                found,
            );
        }
        for ((group, number), declared) in declared {
            let what = format!("@group({group}) @binding({number})");
            self.note(&what, declared, NOTHING.to_owned());
        }
        let bytes = |bytes: u32| format!("{bytes} bytes");
        let declared = self.kernel.workgroup_memory();
        self.note(
            "the workgroup memory",
            bytes(declared),
            bytes(workgroup_memory.unwrap_or(declared)),
        );
    }
}

fn access_name(access: Access) -> &'static str {
    match access {
        Access::Uniform => "uniform",
        Access::Read => "read",
        Access::ReadWrite => "read_write",
    }
}

fn describe(name: &str, access: &str, stride: u32) -> String {
    format!("`{name}` ({access}, {stride} bytes)")
}

/// The workgroup size with the kernel's constants in place of `override`s; what cannot be told is
/// taken as it is declared.
fn workgroup_size(kernel: &Kernel, module: &Module, main: &EntryPoint) -> [u32; 3] {
    let overrides = main.workgroup_size_overrides.unwrap_or_default();
    std::array::from_fn(|axis| match overrides[axis] {
        None => main.workgroup_size[axis],
        Some(expression) => {
            constant(kernel, module, expression).unwrap_or(kernel.workgroup_size()[axis])
        }
    })
}

fn constant(kernel: &Kernel, module: &Module, expression: Handle<Expression>) -> Option<u32> {
    match module.global_expressions[expression] {
        Expression::Literal(Literal::U32(value)) => Some(value),
        Expression::Literal(Literal::I32(value)) => u32::try_from(value).ok(),
        Expression::Constant(handle) => constant(kernel, module, module.constants[handle].init),
        Expression::Override(handle) => overridden(kernel, module, handle),
        _ => None,
    }
}

fn overridden(kernel: &Kernel, module: &Module, handle: Handle<Override>) -> Option<u32> {
    let declared = &module.overrides[handle];
    let name = declared.name.as_deref();
    let given = kernel.constants().find(|(given, _)| Some(*given) == name);
    match given {
        // wgpu refuses those that are no u32.
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "saturates"
        )]
        Some((_, value)) => Some(value as u32),
        None => constant(kernel, module, declared.init?),
    }
}

#[cfg(test)]
mod tests {
    use crate::{Binding, Kernel, STATUS};

    const SHADER: &str = "
        override WIDTH: u32 = 32u;
        struct Size { count: u32, scale: f32 }
        @group(0) @binding(0) var<uniform> size: Size;
        @group(0) @binding(1) var<storage, read> given: array<vec2<f32>>;
        @group(0) @binding(2) var<storage, read_write> result: array<f32>;
        var<workgroup> partial: array<f32, 64>;
        @compute @workgroup_size(WIDTH, 2)
        fn main(@builtin(local_invocation_index) lane: u32) {
            partial[lane] = given[lane].x;
            result[lane] = partial[lane] * f32(size.count);
        }";
    const BINDINGS: &[Binding] = &[
        Binding::uniform::<[u32; 2]>("size"),
        Binding::read::<[f32; 2]>("given"),
        Binding::read_write::<f32>("result"),
    ];

    fn differences(kernel: &Kernel) -> Vec<String> {
        let problems = kernel.differences();
        problems.iter().map(ToString::to_string).collect()
    }

    const RIGHT: Kernel =
        Kernel::new("right", &[SHADER], BINDINGS, [32, 2, 1]).workgroup_memory_of(256);

    #[test]
    fn a_kernel_that_matches_its_shader_has_none() {
        assert_eq!(differences(&RIGHT), [""; 0]);
        // Elements of several words as words.
        const WORDS: &str = "
            @group(0) @binding(0) var<storage, read> words: array<u32>;
            @compute @workgroup_size(1) fn main() { _ = words[0]; }";
        const PAIRS: &[Binding] = &[Binding::read::<f64>("words")];
        let words = Kernel::new("words", &[WORDS], PAIRS, [1, 1, 1]);
        assert_eq!(differences(&words), [""; 0]);
        // A shader that does not compile is the compiler's to refuse.
        assert_eq!(differences(&RIGHT.with("fn (")), [""; 0]);
    }

    #[test]
    fn workgroups_are_compared_with_the_constants_in_place() {
        let other = RIGHT.constant("WIDTH", 64_u32);
        assert_eq!(
            differences(&other),
            [
                "kernel `right`: the workgroup size is declared as [32, 2, 1], its WGSL has [64, 2, 1]"
            ]
        );
        let wrong = Kernel::new("wrong", &[SHADER], BINDINGS, [64, 1, 1]);
        assert_eq!(
            differences(&wrong),
            [
                "kernel `wrong`: the workgroup size is declared as [64, 1, 1], its WGSL has [32, 2, 1]",
                "kernel `wrong`: the workgroup memory is declared as 0 bytes, its WGSL has 256 bytes",
            ]
        );
    }

    /// An array that an `override` sizes is as long as the kernel says, not as its default.
    #[test]
    fn workgroup_memory_is_compared_with_the_constants_in_place() {
        const SIZED: &str = "
            override LANES: u32 = 64u;
            var<workgroup> partial: array<vec2<f32>, LANES>;
            @compute @workgroup_size(1) fn main() { partial[0] = vec2<f32>(0.0); }";
        let of = |bytes| Kernel::new("sized", &[SIZED], &[], [1, 1, 1]).workgroup_memory_of(bytes);
        assert_eq!(differences(&of(512)), [""; 0]);
        assert_eq!(differences(&of(256).constant("LANES", 32_u32)), [""; 0]);
        assert_eq!(
            differences(&of(512).constant("LANES", 32_u32)),
            [
                "kernel `sized`: the workgroup memory is declared as 512 bytes, its WGSL has 256 bytes"
            ]
        );
        // What is computed is not told, and not taken for the default.
        let twice = SIZED.replace("LANES>", "2u * LANES>");
        let twice = |bytes| {
            let kernel = Kernel::new("twice", &[], &[], [1, 1, 1]).with_text(twice.clone());
            kernel.constant("LANES", 32_u32).workgroup_memory_of(bytes)
        };
        assert!(naga::front::wgsl::parse_str(&twice(0).source()).is_ok());
        assert_eq!(differences(&twice(512)), [""; 0]);
    }

    /// The stage is that of the part `STATUS`, by itself or in a longer one.
    #[test]
    fn a_stage_of_ones_own_is_refused() {
        const MAIN: &str = "
            @group(0) @binding(0) var<storage, read_write> status: array<atomic<u32>>;
            @compute @workgroup_size(1) fn main() { fail(0u); }";
        const BINDINGS: &[Binding] = &[Binding::read_write::<u32>("status")];
        let fails =
            |part: String| Kernel::new("fails", &[MAIN], BINDINGS, [1, 1, 1]).with_text(part);
        let longer = fails(format!("// Before.\n{STATUS}\nfn after() {{}}"));
        assert!(longer.can_fail());
        assert_eq!(differences(&longer), [""; 0]);
        let other = fails(STATUS.replace("0u", "1u"));
        assert_eq!(
            differences(&other),
            [
                "kernel `fails`: `override STAGE` is declared as that of the part `STATUS`, its WGSL has another"
            ]
        );
    }

    #[test]
    fn bindings_are_compared_by_number() {
        const WRONG: Kernel = Kernel::new(
            "wrong",
            &[SHADER],
            &[
                Binding::uniform::<[u32; 2]>("size"),
                Binding::read_write::<f32>("given"),
                Binding::read_write::<f32>("outcome"),
                Binding::read::<f32>("more"),
            ],
            [32, 2, 1],
        )
        .workgroup_memory_of(256);
        assert_eq!(
            differences(&WRONG),
            [
                "kernel `wrong`: @group(0) @binding(1) is declared as `given` (read_write, 4 bytes), \
                 its WGSL has `given` (read, 8 bytes)",
                "kernel `wrong`: @group(0) @binding(2) is declared as `outcome` (read_write, 4 bytes), \
                 its WGSL has `result` (read_write, 4 bytes)",
                "kernel `wrong`: @group(0) @binding(3) is declared as `more` (read, 4 bytes), \
                 its WGSL has nothing",
            ]
        );
        let short = Kernel::new("short", &[SHADER], &BINDINGS[..2], [32, 2, 1]);
        assert_eq!(
            differences(&short.workgroup_memory_of(256)),
            [
                "kernel `short`: @group(0) @binding(2) is declared as nothing, \
                 its WGSL has `result` (read_write, 4 bytes)"
            ]
        );
    }

    #[test]
    fn the_entry_point_is_main() {
        const OTHER: &str = "@compute @workgroup_size(1) fn other() {}";
        let kernel = Kernel::new("nameless", &[OTHER], &[], [1, 1, 1]);
        assert_eq!(
            differences(&kernel),
            ["kernel `nameless`: the entry point is declared as main, its WGSL has other"]
        );
    }
}
