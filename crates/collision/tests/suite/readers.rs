//! The readers on arbitrary and on damaged files: they never panic and never let an invalid mesh through.

use proptest::collection::vec;
use proptest::prelude::*;
use vertebra_collision::{MeshError, TriangleMesh};

use crate::files::{TEXT_STL, binary_stl};
use crate::ply_off::{OFF, TEXT_PLY, binary_ply};

const OBJ: &str = "# a comment\nmtllib m.mtl\no thing\nv 0 0 0\nv 1.5e-3 0 -0\nv +1 .5 0.\nv 0 1 0 1.0\nvn 0 0 1\n\
                   vt 0.5 0.5\ng group\nusemtl red\nf 1 2 3\nf 1/1 3/1 4/1\r\nf -4//1 \\\n-3//1 -2//1 -1//1\ns off\n";

/// What every mesh promises, and that its error, if any, has something to say.
fn valid(result: Result<TriangleMesh, MeshError>) {
    match result {
        Ok(mesh) => {
            assert!(mesh.len() > 0);
            assert!(mesh.vertices().iter().all(|v| v.is_finite()));
            let count = mesh.vertices().len();
            let in_range = |&i: &u32| (i as usize) < count;
            assert!(mesh.triangles().iter().flatten().all(in_range));
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
}

fn by_all(bytes: &[u8]) {
    valid(TriangleMesh::from_obj(bytes));
    valid(TriangleMesh::from_stl(bytes));
    valid(TriangleMesh::from_ply(bytes));
    valid(TriangleMesh::from_off(bytes));
}

/// A change to a file: overwrite, insert, remove or repeat a piece.
#[derive(Clone, Debug)]
enum Damage {
    Overwrite(prop::sample::Index, Vec<u8>),
    Insert(prop::sample::Index, Vec<u8>),
    Remove(prop::sample::Index, usize),
    Repeat(prop::sample::Index, usize),
}

fn piece() -> impl Strategy<Value = Vec<u8>> {
    let words: &[&str] = &[
        "v ",
        "f ",
        "\n",
        "\\\n",
        "/",
        "//",
        "-",
        "0",
        "1e999",
        "nan",
        "-1",
        "4294967296",
        "#",
        "solid",
        "endsolid",
        "facet normal",
        "vertex",
        "9223372036854775808",
        "OFF\n",
        "ply\nformat ascii 1.0\n",
        "element vertex ",
        "element face ",
        "property ",
        "list uchar int vertex_indices\n",
        "float x\n",
        "end_header\n",
    ];
    prop_oneof![
        vec(any::<u8>(), 1..8),
        prop::sample::select(words).prop_map(|word| word.as_bytes().to_vec()),
    ]
}

fn damage() -> impl Strategy<Value = Damage> {
    let index = any::<prop::sample::Index>;
    prop_oneof![
        (index(), piece()).prop_map(|(at, bytes)| Damage::Overwrite(at, bytes)),
        (index(), piece()).prop_map(|(at, bytes)| Damage::Insert(at, bytes)),
        (index(), 1..60_usize).prop_map(|(at, count)| Damage::Remove(at, count)),
        (index(), 1..60_usize).prop_map(|(at, count)| Damage::Repeat(at, count)),
    ]
}

fn apply(file: &mut Vec<u8>, damage: &Damage) {
    let span = |at: &prop::sample::Index, count: usize| {
        let start = at.index(file.len() + 1);
        start..(start + count).min(file.len())
    };
    match damage {
        Damage::Overwrite(at, bytes) => {
            let range = span(at, bytes.len());
            file.splice(range, bytes.iter().copied());
        }
        Damage::Insert(at, bytes) => {
            let range = span(at, 0);
            file.splice(range, bytes.iter().copied());
        }
        Damage::Remove(at, count) => {
            let range = span(at, *count);
            file.drain(range);
        }
        Damage::Repeat(at, count) => {
            let range = span(at, *count);
            file.extend_from_within(range);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn arbitrary_bytes(bytes in vec(any::<u8>(), 0..400)) {
        by_all(&bytes);
    }

    #[test]
    fn arbitrary_words(pieces in vec(piece(), 0..60)) {
        by_all(&pieces.join(&b' '));
    }

    #[test]
    fn damaged_files(which in 0..7_usize, damages in vec(damage(), 1..5)) {
        let mut file = match which {
            0 => OBJ.as_bytes().to_vec(),
            1 => TEXT_STL.as_bytes().to_vec(),
            2 => TEXT_PLY.as_bytes().to_vec(),
            3 => OFF.as_bytes().to_vec(),
            4 => binary_ply(false),
            5 => binary_ply(true),
            _ => binary_stl(4),
        };
        for damage in &damages {
            apply(&mut file, damage);
        }
        by_all(&file);
    }

    /// Bytes behind a header that fits them: the numbers themselves.
    #[test]
    fn arbitrary_facets(bytes in vec(any::<u8>(), 50..200)) {
        let facets = bytes.len() / 50;
        let mut file = binary_stl(facets as u32);
        file.truncate(84);
        file.extend(&bytes[..50 * facets]);
        valid(TriangleMesh::from_stl(&file));
    }
}

/// The files that are damaged are good to begin with.
#[test]
fn undamaged_files_are_read() {
    assert_eq!(TriangleMesh::from_obj(OBJ.as_bytes()).unwrap().len(), 4);
    assert_eq!(
        TriangleMesh::from_stl(TEXT_STL.as_bytes()).unwrap().len(),
        2
    );
    assert_eq!(TriangleMesh::from_stl(&binary_stl(4)).unwrap().len(), 4);
}
