//! Mesh files: what is read, what is refused and with which words.

use std::path::Path;

use glam::{DVec3, Vec3};
use vertebra_collision::{MeshError, Place, PlyPart, PolygonProblem, TriangleMesh, write_ply};
use vertebra_spatial::Pose;

use crate::support::gold_mesh;

fn obj(text: &str) -> Result<TriangleMesh, MeshError> {
    TriangleMesh::from_obj(text.as_bytes())
}

const CORNERS: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

fn with_corners(text: &str) -> Result<TriangleMesh, MeshError> {
    obj(&format!("{CORNERS}{text}"))
}

#[test]
fn obj_faces_in_every_notation() {
    for face in [
        "f 1 2 3",
        "f 1/1 2/2 3/3",
        "f 1//1 2//2 3//3",
        "f 1/1/1 2/1/1 3/1/1",
        "f 1/ 2// 3/1/",
        "f -4 -3 -2",
    ] {
        assert_eq!(
            with_corners(face).unwrap().triangles(),
            [[0, 1, 2]],
            "{face}"
        );
    }
    // Relative indices count from the line they are in.
    let mesh = obj("v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 9 9 9\nf -1 -2 -3\n").unwrap();
    assert_eq!(mesh.triangles(), [[0, 1, 2], [3, 2, 1]]);
    // Faces may name vertices that follow.
    assert_eq!(obj("f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0").unwrap().len(), 1);
}

#[test]
fn obj_keeps_the_order_of_the_file_across_groups() {
    let text = "mtllib x.mtl\no one\ng left\nusemtl red\nf 1 2 3\ns off\ng right\nusemtl blue\n\
                vt 0 0\nvn 0 0 1\nf 3 4 1\nl 1 2\np 1\ng left\nf 2 3 4\n";
    let mesh = with_corners(text).unwrap();
    assert_eq!(mesh.triangles(), [[0, 1, 2], [2, 3, 0], [1, 2, 3]]);
    assert_eq!(mesh.vertices().len(), 4);
}

#[test]
fn obj_polygons_become_fans() {
    assert_eq!(
        with_corners("f 2 3 4 1").unwrap().triangles(),
        [[1, 2, 3], [1, 3, 0]]
    );
    let refused = |text: &str, line, problem| {
        assert_eq!(
            with_corners(text),
            Err(MeshError::Polygon {
                place: Place::Line(line),
                problem
            }),
            "{text}"
        );
    };
    refused("v 0 0 1\nf 1 2 3 5", 6, PolygonProblem::NotPlanar);
    refused("v 0.7 0.3 0\n\nf 1 2 3 5", 7, PolygonProblem::NotConvex);
    refused("f 1 2 4 3", 5, PolygonProblem::ZeroArea);
    refused("f 1 1 2 2", 5, PolygonProblem::ZeroArea);
    refused("f 1 2", 5, PolygonProblem::TooFewVertices);
    refused("f", 5, PolygonProblem::TooFewVertices);
    // A triangle may have any shape.
    assert_eq!(with_corners("f 1 1 1").unwrap().zero_area(), [0]);
}

#[test]
fn obj_line_ends_comments_and_continuations() {
    let expected = with_corners("f 1 2 3").unwrap();
    let dos = format!("# made by hand\n{CORNERS}\n\n  f 1 2 3 # last").replace('\n', "\r\n");
    assert_eq!(obj(&dos).unwrap(), expected);
    assert_eq!(obj(&format!("\u{feff}{dos}")).unwrap(), expected);
    assert_eq!(with_corners("f 1 \\\n 2\\\n3\n").unwrap(), expected);
    assert_eq!(with_corners("f 1 2 3 \\").unwrap(), expected);
    assert_eq!(obj(&format!("{CORNERS}\tf\t1  2\t3")).unwrap(), expected);
    // Errors name the line where the statement starts, and count the continued ones.
    let error = with_corners("f 1 \\\n 2 3\nf 1 \\\n x 3").unwrap_err();
    assert!(
        matches!(error, MeshError::Syntax { line: 7, .. }),
        "{error}"
    );
}

#[test]
fn obj_coordinates_are_the_nearest_f32() {
    // Just above the middle of two f32, by less than f64 resolves: rounding twice would go down.
    let mesh = obj("v 1.00000005960464477539062500000001 0.1 -0\nf 1 1 1").unwrap();
    let [vertex] = mesh.vertices() else {
        panic!("one vertex");
    };
    assert_eq!(vertex.to_array(), [1.0 + f32::EPSILON, 0.1, 0.0]);
    // Weight 1 and colours carry nothing.
    assert!(obj("v 1 2 3 1\nv 1 2 3 0.5 0.5 0.5\nv 1 2 3 0.5 0.5 0.5 1\nf 1 2 3").is_ok());
    assert!(matches!(
        obj("v 1 2 3 2\nf 1 1 1"),
        Err(MeshError::Syntax { line: 1, .. })
    ));
}

#[test]
fn obj_malformed_lines_are_named() {
    let syntax = [
        ("v 0 0", 5),
        ("\nv 0 zero 0", 6),
        ("v 0 0 1,5", 5),
        ("v 0 0 1..5", 5),
        ("v 0 0 0 red", 5),
        ("f 1 2 3.5", 5),
        ("f 1 2 /3", 5),
        ("f 1 2 3/x", 5),
        ("f 1 2 3/1/x", 5),
        ("f 1 2 3/1/1/1", 5),
        ("f 1 2 99999999999999999999", 5),
        ("\n\ncurv 0 1 1 2", 7),
        ("triangle 1 2 3", 5),
    ];
    for (text, expected) in syntax {
        let error = with_corners(text).unwrap_err();
        assert!(
            matches!(error, MeshError::Syntax { line, .. } if line == expected),
            "{text}: {error:?}"
        );
    }
    for word in ["nan", "inf", "-infinity", "1e39", "-3.5e38"] {
        assert_eq!(
            with_corners(&format!("v 0 {word} 0")),
            Err(MeshError::NonFiniteCoordinate {
                line: 5,
                found: word.into()
            })
        );
    }
    for (index, text) in [
        (0, "f 1 2 0"),
        (5, "\nf 1 2 5"),
        (-5, "f -5 1 2"),
        (i64::MAX, "f 1 9223372036854775807 2"),
    ] {
        let line = if text.starts_with('\n') { 6 } else { 5 };
        assert_eq!(
            with_corners(text),
            Err(MeshError::FaceIndex {
                line,
                index,
                vertices: 4
            }),
            "{text}"
        );
    }
    let most_negative = format!("f 1 2 {}", i64::MIN);
    assert!(matches!(
        with_corners(&most_negative),
        Err(MeshError::FaceIndex { .. })
    ));
    let binary = TriangleMesh::from_obj(b"v \xff\xfe 0\n");
    assert!(matches!(binary, Err(MeshError::Syntax { line: 1, .. })));
}

#[test]
fn meshes_that_are_none() {
    for text in ["", "\n", "# nothing", CORNERS] {
        assert_eq!(obj(text), Err(MeshError::Empty), "{text}");
    }
    assert_eq!(
        TriangleMesh::new(vec![Vec3::ZERO], vec![]),
        Err(MeshError::Empty)
    );
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for k in 0..3 {
            let mut vertices = vec![Vec3::ZERO; 3];
            vertices[2][k] = bad;
            assert_eq!(
                TriangleMesh::new(vertices, vec![[0, 0, 0]]),
                Err(MeshError::NonFiniteVertex { vertex: 2 })
            );
        }
    }
    assert_eq!(
        TriangleMesh::new(vec![Vec3::ZERO; 3], vec![[0, 1, 2], [0, 3, 1]]),
        Err(MeshError::IndexOutOfRange {
            triangle: 1,
            index: 3,
            vertices: 3
        })
    );
}

#[test]
fn written_obj_reads_back_the_same() {
    let mut vertices = gold_mesh("bowl").vertices().to_vec();
    let extremes = [
        1e-45,
        f32::MIN_POSITIVE,
        f32::MAX,
        -0.0,
        0.1,
        16_777_216.0,
        -1.0 / 3.0,
    ];
    vertices.extend(extremes.map(|x| Vec3::new(x, -x, x)));
    let triangles = gold_mesh("bowl").triangles().to_vec();
    let mesh = TriangleMesh::new(vertices, triangles).unwrap();
    let mut file = Vec::new();
    mesh.write_obj(&mut file).unwrap();
    let read = TriangleMesh::from_obj(&file).unwrap();
    assert_eq!(read, mesh);
    let bits = |m: &TriangleMesh| -> Vec<[u32; 3]> {
        let vertices = m.vertices().iter();
        vertices.map(|v| v.to_array().map(f32::to_bits)).collect()
    };
    assert_eq!(bits(&read), bits(&mesh));
}

/// A binary STL file of so many facets, facet i with corners (i, 0, 0), (0, i, 0), (0, 0, i), whose comment starts
/// like a text file.
pub(crate) fn binary_stl(facets: u32) -> Vec<u8> {
    let mut bytes = vec![b' '; 80];
    bytes[..11].copy_from_slice(b"solid model");
    bytes.extend(facets.to_le_bytes());
    for i in 0..facets {
        for row in 0..4 {
            for column in 0..3 {
                let value = if row == column + 1 { i as f32 } else { 0.0 };
                bytes.extend(value.to_le_bytes());
            }
        }
        bytes.extend([0, 0]);
    }
    bytes
}

pub(crate) const TEXT_STL: &str = "solid a name with words
facet normal 0 0 1
  outer loop
    vertex 0 0 0
    vertex 1.5e0 0 0
    vertex 0 1 0
  endloop
endfacet
  FACET NORMAL nan nan nan
    OUTER LOOP
      VERTEX 0 0 0
      VERTEX 0 0 0
      VERTEX 0 1 0
    ENDLOOP
  ENDFACET
endsolid a name with words
";

#[test]
fn stl_binary_and_text() {
    let mesh = TriangleMesh::from_stl(&binary_stl(3)).unwrap();
    assert_eq!(mesh.triangles(), [[0, 1, 2], [3, 4, 5], [6, 7, 8]]);
    assert_eq!(
        mesh.triangle(2),
        [Vec3::X * 2.0, Vec3::Y * 2.0, Vec3::Z * 2.0]
    );
    assert_eq!(mesh.zero_area(), [0]);

    let dos = TEXT_STL.replace('\n', "\r\n");
    let marked = format!("\u{feff}{TEXT_STL}");
    let twice = format!("{TEXT_STL}\n{TEXT_STL}");
    for (text, facets) in [
        (TEXT_STL, 2),
        (dos.as_str(), 2),
        (marked.as_str(), 2),
        (TEXT_STL.trim_end(), 2),
        (twice.as_str(), 4),
    ] {
        let mesh = TriangleMesh::from_stl(text.as_bytes()).unwrap();
        assert_eq!(mesh.len(), facets);
        assert_eq!(mesh.vertices().len(), 3 * facets);
        assert_eq!(mesh.triangle(0), [Vec3::ZERO, Vec3::X * 1.5, Vec3::Y]);
    }
}

#[test]
fn stl_of_every_shorter_length_is_refused() {
    let binary = binary_stl(2);
    for length in 0..binary.len() {
        let error = TriangleMesh::from_stl(&binary[..length]).unwrap_err();
        let expected = if length < 84 {
            // Up to here it is no worse than the start of a text file.
            matches!(
                error,
                MeshError::StlHeader { .. } | MeshError::Syntax { .. }
            )
        } else {
            error
                == MeshError::StlLength {
                    facets: 2,
                    expected: 184,
                    found: length as u64,
                }
        };
        assert!(expected, "{length}: {error:?}");
    }
    let complete = TEXT_STL.trim_end().len() - " a name with words".len();
    for length in 0..complete {
        let error = TriangleMesh::from_stl(&TEXT_STL.as_bytes()[..length]).unwrap_err();
        let expected = matches!(
            error,
            MeshError::StlHeader { .. }
                | MeshError::Syntax { .. }
                | MeshError::NonFiniteCoordinate { .. }
        );
        assert!(expected, "{length}: {error:?}");
    }
}

#[test]
fn stl_counts_and_numbers_that_cannot_be() {
    assert_eq!(
        TriangleMesh::from_stl(&binary_stl(0)),
        Err(MeshError::Empty)
    );
    for facets in [1, 3, 0x7fff_ffff, u32::MAX] {
        let mut absurd = binary_stl(2);
        absurd[80..84].copy_from_slice(&facets.to_le_bytes());
        assert_eq!(
            TriangleMesh::from_stl(&absurd),
            Err(MeshError::StlLength {
                facets,
                expected: 84 + 50 * u64::from(facets),
                found: 184
            })
        );
    }
    for bad in [f32::NAN, f32::INFINITY] {
        let mut bytes = binary_stl(3);
        let second_facet = 84 + 50;
        bytes[second_facet + 20..][..4].copy_from_slice(&bad.to_le_bytes());
        assert_eq!(
            TriangleMesh::from_stl(&bytes),
            Err(MeshError::StlNonFinite {
                facet: 1,
                offset: 134
            })
        );
        // Normals are not looked at.
        let mut bytes = binary_stl(3);
        bytes[second_facet..][..4].copy_from_slice(&bad.to_le_bytes());
        assert!(TriangleMesh::from_stl(&bytes).is_ok());
    }
}

#[test]
fn stl_text_errors_name_the_line() {
    let cases = [
        ("vertex 0 0 0", "vertex 0 0", 4),
        ("vertex 0 0 0", "vertex 0 0 0 0", 4),
        ("vertex 0 0 0", "vertex 0 0 x", 4),
        ("outer loop", "outer", 3),
        ("facet normal", "facet", 2),
        ("  endloop", "  vertex 1 1 1", 7),
        ("endfacet\n", "\n", 9),
        ("endsolid a name with words\n", "", 16),
    ];
    for (from, to, expected) in cases {
        let text = TEXT_STL.replacen(from, to, 1);
        let error = TriangleMesh::from_stl(text.as_bytes()).unwrap_err();
        assert!(
            matches!(error, MeshError::Syntax { line, .. } if line == expected),
            "{to}: {error:?}"
        );
    }
    let text = TEXT_STL.replacen("1.5e0", "1.5e99", 1);
    assert!(matches!(
        TriangleMesh::from_stl(text.as_bytes()),
        Err(MeshError::NonFiniteCoordinate { line: 5, .. })
    ));
}

#[test]
fn read_goes_by_extension_and_names_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        path
    };
    let good = format!("{CORNERS}f 1 2 3\n");
    assert_eq!(
        TriangleMesh::read(file("a.OBJ", good.as_bytes()))
            .unwrap()
            .len(),
        1
    );
    assert_eq!(
        TriangleMesh::read(file("b.stl", &binary_stl(2)))
            .unwrap()
            .len(),
        2
    );

    let in_file = |path: &Path| match TriangleMesh::read(path).unwrap_err() {
        MeshError::InFile { path: named, error } if named == path => *error,
        error => panic!("{error:?}"),
    };
    for name in ["c.glb", "d", "obj", ".obj"] {
        let path = file(name, good.as_bytes());
        assert_eq!(in_file(&path), MeshError::UnknownExtension, "{name}");
    }
    let kind = std::io::ErrorKind::NotFound;
    assert_eq!(
        in_file(&folder.path().join("none.obj")),
        MeshError::Read { kind }
    );
    let bad = file("bad.obj", b"v 0 0 0\nf 1 2 3\n");
    let error = TriangleMesh::read(&bad).unwrap_err();
    let path = bad.display();
    let cause =
        "line 2: the face names vertex 2, but there are 1 (counted from 1, negative from the end)";
    assert_eq!(
        error.to_string(),
        format!("the mesh file {path} cannot be used: {cause}")
    );
    // Chains of errors would say it twice.
    assert!(std::error::Error::source(&error).is_none());
}

/// A minimal reader of what the writer promises.
#[test]
fn ply_holds_all_parts_with_their_colors() {
    let a = with_corners("f 1 2 3\nf 1 3 4").unwrap();
    let b = TriangleMesh::from_stl(&binary_stl(2)).unwrap();
    let (red, by_index) = (|_: usize| [255, 0, 0], |i: usize| [0, i as u8, 7]);
    let mut file = Vec::new();
    let shift = Pose::from_translation(DVec3::new(10.0, 0.0, 0.0));
    let parts = [
        PlyPart {
            mesh: &a,
            pose: Pose::IDENTITY,
            color: &red,
        },
        PlyPart {
            mesh: &b,
            pose: shift,
            color: &by_index,
        },
    ];
    write_ply(&mut file, &parts).unwrap();
    let end = b"end_header\n";
    let header = file.windows(end.len()).position(|w| w == end).unwrap() + end.len();
    let text = std::str::from_utf8(&file[..header]).unwrap();
    assert!(text.contains("element vertex 10\n") && text.contains("element face 4\n"));
    let (vertices, faces) = file[header..].split_at(10 * 12);
    let x = |i: usize| f32::from_le_bytes(vertices[12 * i..][..4].try_into().unwrap());
    assert_eq!((x(1), x(4), x(7)), (1.0, 10.0, 11.0));
    assert_eq!(faces.len(), 4 * 16);
    let face = |i: usize| {
        let bytes = &faces[16 * i..][..16];
        let index = |k: usize| u32::from_le_bytes(bytes[1 + 4 * k..][..4].try_into().unwrap());
        (
            bytes[0],
            [0, 1, 2].map(index),
            [bytes[13], bytes[14], bytes[15]],
        )
    };
    assert_eq!(face(1), (3, [0, 2, 3], [255, 0, 0]));
    assert_eq!(face(3), (3, [7, 8, 9], [0, 1, 7]));
}
