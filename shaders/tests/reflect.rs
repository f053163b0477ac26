//! Every shader as naga reads it, compared with what the host believes of it. No GPU is needed.
#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test says what is wrong by failing"
)]

use std::mem::{offset_of, size_of};

use naga::valid::{Capabilities, ValidationFlags, Validator};
use naga::{AddressSpace, Module, StorageAccess, TypeInner};
use vertebra_gpu::{Access, Binding, Kernel, wgpu::Features};
use vertebra_shaders::dca::{Layer, Sizes};
use vertebra_shaders::{Bins, KERNELS, Numbers, Pass, Range};

fn parse(name: &str, kernel: &Kernel) -> Module {
    let source = kernel.source();
    naga::front::wgsl::parse_str(&source)
        .unwrap_or_else(|error| panic!("{name}:\n{}", error.emit_to_string(&source)))
}

fn capabilities(features: Features) -> Capabilities {
    let mut capabilities = Capabilities::empty();
    capabilities.set(
        Capabilities::FLOAT64,
        features.contains(Features::SHADER_F64),
    );
    capabilities.set(
        Capabilities::SUBGROUP,
        features.contains(Features::SUBGROUP),
    );
    capabilities
}

#[test]
fn every_shader_is_valid_with_the_features_its_kernel_names() {
    for (name, kernel) in KERNELS.iter() {
        let module = parse(name, kernel);
        let mut validator = Validator::new(ValidationFlags::all(), capabilities(kernel.features()));
        validator
            .subgroup_stages(naga::valid::ShaderStages::COMPUTE)
            .subgroup_operations(naga::valid::SubgroupOperationSet::all());
        if let Err(error) = validator.validate(&module) {
            panic!("{name}:\n{}", error.emit_to_string(&kernel.source()));
        }
    }
}

#[test]
fn every_loop_is_seen_to_end() {
    for (name, kernel) in KERNELS.iter() {
        assert!(kernel.loops_end(), "{name}");
    }
}

/// The bindings of a module in the words of the host.
fn bindings(module: &Module) -> Vec<(u32, String, Access, u32)> {
    let layouts = layouts(module);
    let mut found: Vec<_> = module
        .global_variables
        .iter()
        .filter_map(|(_, variable)| {
            let place = variable.binding.as_ref()?;
            assert_eq!(place.group, 0);
            let access = match variable.space {
                AddressSpace::Uniform => Access::Uniform,
                AddressSpace::Storage { access } if access.contains(StorageAccess::STORE) => {
                    Access::ReadWrite
                }
                AddressSpace::Storage { .. } => Access::Read,
                other => panic!("a binding in {other:?}"),
            };
            let stride = match module.types[variable.ty].inner {
                TypeInner::Array { stride, .. } => stride,
                _ => layouts[variable.ty].size,
            };
            let name = variable.name.clone().unwrap();
            Some((place.binding, name, access, stride))
        })
        .collect();
    found.sort_by_key(|(number, ..)| *number);
    found
}

fn layouts(module: &Module) -> naga::proc::Layouter {
    let mut layouter = naga::proc::Layouter::default();
    layouter.update(module.to_ctx()).unwrap();
    layouter
}

fn expected(kernel: &Kernel) -> Vec<(u32, String, Access, u32)> {
    let entry = |(number, binding): (u32, &Binding)| {
        (
            number,
            binding.name.to_owned(),
            binding.access,
            binding.stride,
        )
    };
    (0..).zip(kernel.bindings()).map(entry).collect()
}

#[test]
fn bindings_are_those_of_the_kernel() {
    for (name, kernel) in KERNELS.iter() {
        assert_eq!(bindings(&parse(name, kernel)), expected(kernel), "{name}");
    }
}

#[test]
fn a_binding_that_differs_is_noticed() {
    let (name, kernel) = &KERNELS[0];
    let wrong = kernel.clone().stride("data", 12);
    assert_ne!(bindings(&parse(name, &wrong)), expected(&wrong));
}

#[test]
fn workgroups_are_those_of_the_kernel() {
    for (name, kernel) in KERNELS.iter() {
        let module = parse(name, kernel);
        let [entry] = &module.entry_points[..] else {
            panic!("{name} has {} entry points", module.entry_points.len());
        };
        assert_eq!(entry.name, "main");
        assert_eq!(entry.workgroup_size, kernel.workgroup_size(), "{name}");
        let layouts = layouts(&module);
        let shared = module.global_variables.iter();
        let shared = shared.filter(|(_, v)| v.space == AddressSpace::WorkGroup);
        let bytes: u32 = shared.map(|(_, v)| layouts[v.ty].size).sum();
        assert_eq!(bytes, kernel.workgroup_memory(), "{name}");
    }
}

/// Names and offsets of the fields of a struct that the host and shaders share.
macro_rules! fields {
    ($ty:ident: $($field:ident),*) => {
        (stringify!($ty), size_of::<$ty>(), vec![$((stringify!($field), offset_of!($ty, $field))),*])
    };
}

#[test]
fn structs_are_laid_out_alike_on_both_sides() {
    let mut host = vec![
        fields!(Range: count, tiles),
        fields!(Pass: count, tiles, shift, mask),
        fields!(Bins: count, bins),
        fields!(Numbers: count, words),
        fields!(Layer: count, rounds, starts, ways, stage),
        fields!(Sizes: slots, positions, dofs, chunks, joins, chunk_nodes, inners, leaves, rakes, carriers, single, chunk_words, join_words, sum_words, rake_words, length),
    ];
    for (name, kernel) in KERNELS.iter() {
        let module = parse(name, kernel);
        for (_, variable) in module.global_variables.iter() {
            if variable.space != AddressSpace::Uniform {
                continue;
            }
            let ty = &module.types[variable.ty];
            let TypeInner::Struct { members, span } = &ty.inner else {
                continue;
            };
            let struct_name = ty.name.as_deref().unwrap();
            let (_, size, fields) = host
                .iter()
                .find(|(name, ..)| *name == struct_name)
                .unwrap_or_else(|| panic!("{name}: nothing on the host is called {struct_name}"));
            assert_eq!(*span as usize, *size, "{struct_name}");
            let found: Vec<_> = members
                .iter()
                .map(|member| (member.name.as_deref().unwrap(), member.offset as usize))
                .collect();
            assert_eq!(&found, fields, "{struct_name}");
        }
    }
    host.dedup();
    assert_eq!(host.len(), 6);
}

/// Lines that declare a variable without a type and give it a floating-point literal: it would be
/// f32 even where `real` is f64.
fn untyped_floats(source: &str) -> Vec<&str> {
    let is_float = |word: &str| {
        let (whole, rest) = word.split_once('.').unwrap_or(("", ""));
        !whole.is_empty()
            && whole.bytes().all(|b| b.is_ascii_digit())
            && rest.bytes().all(|b| b.is_ascii_alphanumeric())
    };
    let is_suspect = |line: &&str| {
        let Some((left, right)) = line.split_once('=') else {
            return false;
        };
        let declares = ["let ", "var ", "const "]
            .iter()
            .any(|word| left.trim_start().starts_with(word));
        let separators = |c: char| !(c.is_ascii_alphanumeric() || c == '.');
        declares && !left.contains(':') && right.split(separators).any(is_float)
    };
    source.lines().filter(is_suspect).collect()
}

#[test]
fn no_float_is_declared_without_a_type() {
    for (name, kernel) in KERNELS.iter() {
        assert_eq!(untyped_floats(&kernel.source()), [""; 0], "{name}");
    }
    // What the test is for: this holds the nearest f32, whatever `real` is.
    let planted = "    let tenth = 0.1;\n    let fine: real = 0.1;\n    let word = 3u;";
    assert_eq!(untyped_floats(planted), ["    let tenth = 0.1;"]);
    assert_eq!(untyped_floats("var x = -2.5e3 * y;").len(), 1);
}
