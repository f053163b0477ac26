//! Every shader as naga reads it, compared with what the host believes of it. No GPU is needed.
#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test says what is wrong by failing"
)]

use std::mem::{offset_of, size_of};

use naga::valid::{Capabilities, ValidationFlags, Validator};
use naga::{Handle, Module, Type, TypeInner};
use vertebra_gpu::{Kernel, wgpu::Features};
use vertebra_shaders::{
    BatchLink, BatchPlan, Bins, Digit, KERNELS, Lengths, Range, Ranges, collision, dca,
};

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

#[test]
fn shaders_are_what_their_kernels_declare() {
    for (name, kernel) in KERNELS.iter() {
        assert_eq!(kernel.differences(), [], "{name}");
    }
}

/// Names and offsets of the fields of a struct that the host and shaders share.
macro_rules! fields {
    ($module:ident::$ty:ident: $($field:ident),*) => {{
        use $module::$ty;
        fields!($ty: $($field),*)
    }};
    ($ty:ident: $($field:ident),*) => {
        (stringify!($ty), size_of::<$ty>(), vec![$((stringify!($field), offset_of!($ty, $field))),*])
    };
}

#[test]
fn structs_are_laid_out_alike_on_both_sides() {
    let host = [
        fields!(Range: count, tiles, unused),
        fields!(Ranges: level),
        fields!(Lengths: most, tile, per_tile, further_tile),
        fields!(Digit: shift, mask),
        fields!(Bins: count, bins),
        fields!(BatchLink: kind, parent, position, dof, flags, handoff, first, gathered, pushed),
        fields!(BatchPlan: groups, stride, levels, steps, done, half, positions, dofs),
        fields!(dca::Layer: count, rounds, starts, ways, stage, sweep, attempt),
        fields!(dca::Sizes: slots, positions, dofs, chunks, joins, chunk_nodes, inners, leaves, rakes, carriers, single, chunk_words, cut_words, sum_words, rake_words, length, pushes, balls),
        fields!(collision::Sizes: jobs, groups, queue, level, a_at, b_at),
        fields!(collision::Split: pairs, ordered),
        fields!(collision::Places: queue, hits, undecided, left, answer, answer_a, row, rows),
        fields!(collision::Mesh: triangles, root),
        fields!(collision::Tolerance: epsilon),
        fields!(collision::Bodies: jobs),
        // Without the words that fill up their alignment.
        fields!(collision::Tree: top, levels),
        fields!(
            collision::Job: rows, coordinate_error, edge_error, first_group, itself, a_first, a_blocks, b_first, b_blocks, a_pose,
            b_pose
        ),
        fields!(collision::Levels: children, children_at, parents, parents_at, grandparents, grandparents_at),
    ];
    let mut seen = std::collections::BTreeSet::new();
    for (name, kernel) in KERNELS.iter() {
        let module = parse(name, kernel);
        for ty in shared_types(&module) {
            let TypeInner::Struct { members, span } = &module.types[ty].inner else {
                continue;
            };
            let struct_name = module.types[ty].name.clone().unwrap();
            let found: Vec<_> = members
                .iter()
                .map(|member| (member.name.as_deref().unwrap(), member.offset as usize))
                .collect();
            let found = (struct_name.as_str(), *span as usize, found);
            let known = host.iter().position(|known| *known == found);
            let known =
                known.unwrap_or_else(|| panic!("{name}: {found:?} is no struct of the host"));
            seen.insert(known);
        }
    }
    assert_eq!(seen.len(), host.len(), "only {seen:?} are in shaders");
}

/// The types of everything bound, and those inside them.
fn shared_types(module: &Module) -> Vec<Handle<Type>> {
    let bound = module.global_variables.iter();
    let bound = bound.filter(|(_, variable)| variable.binding.is_some());
    let mut types: Vec<_> = bound.map(|(_, variable)| variable.ty).collect();
    let mut next = 0;
    while let Some(&ty) = types.get(next) {
        match &module.types[ty].inner {
            TypeInner::Array { base, .. } => types.push(*base),
            TypeInner::Struct { members, .. } => types.extend(members.iter().map(|m| m.ty)),
            _ => {}
        }
        next += 1;
    }
    types
}

/// Statements that declare a variable without a type and give it a floating-point literal: it would be
/// f32 even where `real` is f64.
fn untyped_floats(source: &str) -> Vec<String> {
    let source = without_comments(source);
    let is_suspect = |statement: &&str| {
        let statement = statement.strip_prefix("for").unwrap_or(statement);
        let statement = statement.trim_start_matches(['(', ' ', '\n']);
        let mut words = statement.split_whitespace();
        let declares = words
            .next()
            .is_some_and(|word| ["let", "var", "const"].contains(&word));
        let Some((left, right)) = statement.split_once('=') else {
            return false;
        };
        declares && !left.contains(':') && float_literals(right)
    };
    let statements = source.split([';', '{', '}']).map(str::trim);
    statements.filter(is_suspect).map(str::to_owned).collect()
}

/// A shader without what stands behind `//` and between `/*` and `*/`, which nest.
fn without_comments(source: &str) -> String {
    let lines = source.lines();
    let code = lines.map(|line| line.split_once("//").map_or(line, |(code, _)| code));
    let code = code.collect::<Vec<_>>().join("\n");
    let (mut kept, mut depth, mut rest) = (String::new(), 0_u32, code.as_str());
    while let Some(c) = rest.chars().next() {
        let (skipped, next) = match rest.get(..2) {
            Some("/*") => (2, depth + 1),
            Some("*/") if depth > 0 => (2, depth - 1),
            _ => (c.len_utf8(), depth),
        };
        if depth == 0 && next == 0 {
            kept.push(c);
        }
        (rest, depth) = (&rest[skipped..], next);
    }
    kept
}

/// Whether there is a literal like `1.0`, `1.`, `.5`, `1e-3` or `2f` in an expression.
fn float_literals(expression: &str) -> bool {
    // A sign belongs to an exponent, else it parts words.
    let text = expression.to_ascii_lowercase();
    let mut words = vec![String::new()];
    let mut last = ' ';
    for c in text.chars() {
        let in_exponent = "+-".contains(c) && last == 'e' && starts_number(words.last().unwrap());
        if c.is_ascii_alphanumeric() || c == '.' || c == '_' || in_exponent {
            words.last_mut().unwrap().push(c);
        } else {
            words.push(String::new());
        }
        last = c;
    }
    words.iter().any(|word| {
        starts_number(word) && !word.starts_with("0x") && word.contains(['.', 'e', 'f', 'h'])
    })
}

fn starts_number(word: &str) -> bool {
    let digits = word.strip_prefix('.').unwrap_or(word);
    digits.starts_with(|c: char| c.is_ascii_digit())
}

#[test]
fn no_float_is_declared_without_a_type() {
    for (name, kernel) in KERNELS.iter() {
        assert_eq!(untyped_floats(&kernel.source()), [""; 0], "{name}");
    }
    // What the test is for: these hold the nearest f32, whatever `real` is.
    for planted in [
        "    let tenth = 0.1;",
        "let x = 1e-3;",
        "let x = .5;",
        "var x = -2.5e3 * y;",
        "const HALF = 1. / 2.;",
        "let x = 2f;",
        "let x = a * 1E+3;",
        "if wide { let x = 0.5; }",
        "for (var x = 0.5; x < 2.0; x += 0.5) {",
        "for(var x = 0.5; x < 2.0; x += 0.5) {",
        "let x =\n    y +\n    0.5;",
        "let\n    x = 0.5;",
        "let y: real = 1.0; let x = 0.5; let z = 2u;",
        "let x = /* a half */ 0.5; // and no more",
        "let x = a // times\n    * 0.5;",
    ] {
        assert_eq!(untyped_floats(planted).len(), 1, "{planted}");
    }
    for fine in [
        "let fine: real = 0.1;",
        "let word = 3u;",
        "let x = v.x + items[2].y;",
        "let mask = 0x7f800000u;",
        "let e3 = e2 - 1;",
        "let x = y; // 0.5",
        "x = 0.5 * y;",
        "let x = y; /* let z = 0.5; /* nested */ let z = 0.5; */ x = 0.5;",
        "// let x = 0.5;",
        "let x = y\n    - z; x = 0.5;",
    ] {
        assert_eq!(untyped_floats(fine), [""; 0]);
    }
}
