//! What does not fit together is refused by name, without a GPU.

use vertebra_gpu::wgpu::{Features, Limits};
use vertebra_gpu::{Error, Problem, Recording};
use vertebra_shaders::{
    Operator, Precision, Reduce, Scan, ScanKind, Sort, compact, compact_counted,
};

/// What a device without f64 would say.
fn problems(record: impl FnOnce(&mut Recording)) -> Vec<Problem> {
    let mut recording = Recording::new("refused");
    record(&mut recording);
    match recording.check(&Limits::default(), Features::empty()) {
        Err(Error::Recording { problems, .. }) => problems,
        _ => Vec::new(),
    }
}

fn texts(record: impl FnOnce(&mut Recording)) -> Vec<String> {
    problems(record).iter().map(Problem::to_string).collect()
}

#[test]
fn buffers_of_unequal_length_are_named() {
    let found = texts(|recording| {
        let keys = recording.buffer::<u32>("ids", 5);
        let values = recording.buffer::<u32>("places", 4);
        Sort::portable().record(recording, keys, values, 32);
    });
    assert_eq!(
        found,
        ["sort: `ids` has 5 elements and `places` has 4; they must have equally many"]
    );
    let found = texts(|recording| {
        let data = recording.buffer::<u32>("data", 5);
        let sums = recording.buffer::<u32>("sums", 6);
        Scan::new(&Operator::add_u32()).record(recording, data, sums, ScanKind::Inclusive);
    });
    assert_eq!(
        found,
        ["scan: `data` has 5 elements and `sums` has 6; they must have equally many"]
    );
    let found = texts(|recording| {
        let [flags, values, kept, count] = [("flags", 5), ("values", 6), ("kept", 7), ("count", 0)]
            .map(|(name, len)| recording.buffer::<u32>(name, len));
        compact(recording, flags, values, kept, count);
    });
    assert_eq!(
        found,
        [
            "compact: `flags` has 5 elements and `values` has 6; they must have equally many",
            "compact: `flags` has 5 elements and `kept` has 7; they must have equally many",
            "compact: `count` has 0 bytes, not 4",
        ]
    );
}

#[test]
fn a_place_for_numbers_is_asked_for() {
    let found = problems(|recording| {
        let nothing = recording.buffer::<u32>("nothing", 0);
        let [data, result] = ["data", "result"].map(|name| recording.buffer::<u32>(name, 9));
        let kind = ScanKind::Exclusive;
        Reduce::new(&Operator::add_u32()).record(recording, data, nothing);
        Scan::new(&Operator::add_u32()).record_counted(recording, data, result, kind, nothing);
        Sort::portable().record_counted(recording, data, result, 32, nothing);
        compact_counted(recording, data, data, result, nothing, nothing);
    });
    let is_size =
        |problem: &&Problem| matches!(problem, Problem::Size { buffer, .. } if buffer == "nothing");
    assert_eq!(found.iter().filter(is_size).count(), 5, "{found:?}");
}

#[test]
fn what_fits_is_not_refused() {
    let found = texts(|recording| {
        let [data, other, result, count] = [("data", 9), ("other", 9), ("result", 9), ("count", 1)]
            .map(|(name, len)| recording.buffer::<u32>(name, len));
        let kind = ScanKind::Exclusive;
        Scan::new(&Operator::add_u32()).record_counted(recording, data, result, kind, count);
        Reduce::new(&Operator::add_u32()).record(recording, data, count);
        Sort::portable().record(recording, data, other, 7);
        compact_counted(recording, data, other, result, count, count);
    });
    assert_eq!(found, [""; 0]);
}

/// The maps x -> a x + b.
const MAPS: &str = "
    alias Element = vec2<real>;
    fn identity() -> Element { return Element(1, 0); }
    fn combine(f: Element, g: Element) -> Element { return Element(g.x * f.x, g.x * f.y + g.y); }";

#[test]
fn elements_and_features_of_an_operator_are_checked() {
    let sum = |operator: Operator| {
        problems(|recording| {
            let maps = recording.buffer::<[f32; 2]>("maps", 3000);
            let result = recording.buffer::<[f32; 2]>("result", 1);
            Reduce::new(&operator).record(recording, maps, result);
        })
    };
    let fine = Operator::new::<[f32; 2]>(MAPS).in_precision(Precision::F32);
    assert_eq!(sum(fine), []);
    let strides = sum(Operator::new::<[f64; 2]>(MAPS).in_precision(Precision::F32));
    let is_stride = |p: &Problem| {
        matches!(
            p,
            Problem::Stride {
                expected: 16,
                given: 8,
                ..
            }
        )
    };
    assert!(
        !strides.is_empty() && strides.iter().all(is_stride),
        "{strides:?}"
    );
    let features = sum(Operator::new::<[f32; 2]>(MAPS).in_precision(Precision::F64));
    let is_feature =
        |p: &Problem| matches!(p, Problem::Feature { features, .. } if features == "SHADER_F64");
    assert!(
        !features.is_empty() && features.iter().all(is_feature),
        "{features:?}"
    );
}
