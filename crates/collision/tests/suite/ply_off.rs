//! PLY and OFF: what is read, what is refused and with which words.

use glam::Vec3;
use vertebra_collision::{MeshError, Place, PlyPart, PolygonProblem, TriangleMesh, write_ply};
use vertebra_spatial::Pose;

use crate::support::gold_mesh;

/// A square and a triangle, with all that may be passed over.
pub(crate) const TEXT_PLY: &str = "ply
format ascii 1.0
comment a comment
obj_info made by hand
element camera 1
property float view
property list uchar int extras
element vertex 5
property double x
property uchar red
property float y
property float z
element edge 0
element face 2
property list uchar uint vertex_indices
property list uchar float texcoord
end_header
0.5 2 7 -8
0 255 0 0
1.5e0 0 0 -0
1.5 9 1 0

 0 9 1 0
-1 9 1 0.1
4 0 1 2 3 2 0.25 1
3 4 3 2 0
";

/// The same in binary, its numbers of other types.
pub(crate) fn binary_ply(big_endian: bool) -> Vec<u8> {
    let order = if big_endian { "big" } else { "little" };
    let mut file = format!(
        "ply\r\nformat binary_{order}_endian 1.0\nelement vertex 5\nproperty float x\nproperty short red\n\
         property double y\nproperty int8 z\nelement face 2\nproperty list ushort int vertex_index\n\
         property list char uint8 flags\nend_header\n"
    )
    .into_bytes();
    let mut put = |bytes: &[u8]| {
        let mut bytes = bytes.to_vec();
        if big_endian {
            bytes.reverse();
        }
        file.extend(bytes);
    };
    for [x, y, z] in [[0, 0, 0], [15, 0, 0], [15, 10, 0], [0, 10, 0], [-10, 10, 1]] {
        put(&(x as f32 / 10.0).to_le_bytes());
        put(&(-7_i16).to_le_bytes());
        put(&(f64::from(y) / 10.0).to_le_bytes());
        put(&(z as i8).to_le_bytes());
    }
    for face in [&[0, 1, 2, 3][..], &[4, 3, 2]] {
        put(&(face.len() as u16).to_le_bytes());
        for corner in face {
            put(&i32::to_le_bytes(*corner));
        }
        put(&[2]);
        put(&[1]);
        put(&[0]);
    }
    file
}

pub(crate) const OFF: &str = "OFF # a square and a triangle
5 2 0
0 0 0
1.5 0 0
1.5 1 0  # a corner

0 1 0
-1 1 0.1
4 0 1 2 3 255 0 0
3 4 3 2
";

fn ply(text: &str) -> Result<TriangleMesh, MeshError> {
    TriangleMesh::from_ply(text.as_bytes())
}

fn off(text: &str) -> Result<TriangleMesh, MeshError> {
    TriangleMesh::from_off(text.as_bytes())
}

#[test]
fn all_notations_are_one_mesh() {
    let mesh = ply(TEXT_PLY).unwrap();
    assert_eq!(mesh.triangles(), [[0, 1, 2], [0, 2, 3], [4, 3, 2]]);
    assert_eq!(mesh.vertices()[4], Vec3::new(-1.0, 1.0, 0.1));
    assert!(mesh.vertices()[1].z.is_sign_negative());
    assert_eq!(ply(&TEXT_PLY.replace('\n', "\r\n")).unwrap(), mesh);
    assert_eq!(off(OFF).unwrap(), mesh);
    assert_eq!(off(&OFF.replace('\n', "\r\n")).unwrap(), mesh);
    for header in ["", "COFF\n", "STCNOFF ", "NOFF"] {
        let text = OFF.replacen("OFF # a square and a triangle", header, 1);
        assert_eq!(off(&text).unwrap(), mesh, "{header}");
    }
    let [little, big] = [false, true].map(|big| TriangleMesh::from_ply(&binary_ply(big)).unwrap());
    assert_eq!(little, big);
    assert_eq!(little.triangles(), mesh.triangles());
    // Elements in another order, and a line end after the last.
    let text = "ply\nformat ascii 1.0\nelement face 1\nproperty list int int vertex_index\nelement vertex 3\n\
                property int z\nproperty int y\nproperty int x\nend_header\n3 2 1 0\n1 2 3\n4 5 6\n7 8 9";
    let mesh = ply(text).unwrap();
    assert_eq!(mesh.triangles(), [[2, 1, 0]]);
    assert_eq!(mesh.vertices()[0], Vec3::new(3.0, 2.0, 1.0));
    let mut file = binary_ply(false);
    file.push(b'\n');
    assert_eq!(TriangleMesh::from_ply(&file).unwrap(), little);
}

/// Text is rounded once, to the nearest `f32`.
#[test]
fn coordinates_are_the_nearest_f32() {
    // Halfway between two f32, and beyond it by what an f64 does not hold.
    let text = TEXT_PLY.replace("1.5e0", "1.000000059604644775390625000000000000000001");
    assert_eq!(ply(&text).unwrap().vertices()[1].x, 1.0_f32.next_up());
}

#[test]
fn what_was_written_reads_back_the_same() {
    for name in ["sphere", "cylinder", "bowl"] {
        let mesh = gold_mesh(name);
        let color = |_: usize| [1, 2, 3];
        let part = PlyPart {
            mesh: &mesh,
            pose: Pose::IDENTITY,
            color: &color,
        };
        let mut file = Vec::new();
        write_ply(&mut file, &[part]).unwrap();
        assert_eq!(TriangleMesh::from_ply(&file).unwrap(), mesh);
    }
}

#[test]
fn header_errors_name_the_line() {
    let header = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                  element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    assert!(ply(header).is_ok());
    for (from, to, line) in [
        ("ply\n", "plx\n", 1),
        ("ascii", "ebcdic", 2),
        ("1.0", "2.0", 2),
        ("format ascii 1.0\n", "", 8),
        (
            "format ascii 1.0\n",
            "format ascii 1.0\nformat ascii 1.0\n",
            3,
        ),
        ("vertex 3", "vertex", 3),
        ("vertex 3", "vertex -3", 3),
        ("element vertex 3\n", "", 3),
        ("float y", "half y", 5),
        ("float y", "float", 5),
        ("float y", "float x", 5),
        ("float z", "float w", 9),
        ("face 1", "vertex 1", 7),
        ("uchar int", "float int", 8),
        ("uchar int", "uchar float", 9),
        ("uchar int vertex_indices", "uchar int corners", 9),
        ("property list", "propertylist", 8),
        ("end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "comment", 9),
    ] {
        let text = header.replacen(from, to, 1);
        assert_ne!(text, header);
        let error = ply(&text).unwrap_err();
        assert!(
            matches!(error, MeshError::Syntax { line: found, .. } if found == line),
            "{from} -> {to}: {error:?}"
        );
    }
    for (from, to, line) in [
        ("0 1 0\n", "0 1\n", 12),
        ("0 1 0\n", "0 1 0 0\n", 12),
        ("0 1 0\n", "0 x 0\n", 12),
        ("3 0 1 2", "3 0 1", 13),
        ("3 0 1 2", "3 0 1 2.0", 13),
        ("3 0 1 2", "3 0 1 2 3", 13),
        ("3 0 1 2\n", "", 13),
        ("3 0 1 2\n", "3 0 1 2\n\nmore\n", 15),
    ] {
        let error = ply(&header.replacen(from, to, 1)).unwrap_err();
        assert!(
            matches!(error, MeshError::Syntax { line: found, .. } if found == line),
            "{from} -> {to}: {error:?}"
        );
    }
    let place = Place::Line(13);
    assert_eq!(
        ply(&header.replace("3 0 1 2", "3 0 1 -1")),
        Err(MeshError::FaceVertex {
            place,
            index: -1,
            vertices: 3
        })
    );
    let count = -3;
    let error = ply(&header
        .replace("3 0 1 2", "-3 0 1 2")
        .replace("uchar int", "char int"));
    assert_eq!(error, Err(MeshError::NegativeCount { place, count }));
    let strips = "element tristrips 1\nproperty list int int vertex_indices\nend_header\n";
    let error = ply(&header.replace("end_header\n", strips)).unwrap_err();
    assert_eq!(
        error.to_string(),
        "line 9: expected triangles in an element `face`, not in strips, found `element tristrips 1`"
    );
    assert_eq!(
        ply(&header.replace("3 0 1 2", "2 0 1")),
        Err(MeshError::Polygon {
            place,
            problem: PolygonProblem::TooFewVertices
        })
    );
    assert_eq!(
        ply(&header.replace("1 0 0\n", "1 0 1e39\n")),
        Err(MeshError::NonFiniteCoordinate {
            line: 11,
            found: "1e39".into()
        })
    );
    let points = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n\
                  end_header\n0 0 0\n";
    assert_eq!(ply(points), Err(MeshError::Empty));
    // Elements without properties take no time, whatever their number.
    let none = points.replace(
        "element vertex",
        "element ghost 18446744073709551615\nelement vertex",
    );
    assert_eq!(ply(&none), Err(MeshError::Empty));
}

#[test]
fn binary_errors_name_the_element() {
    for big_endian in [false, true] {
        let good = binary_ply(big_endian);
        let marker = b"end_header\n";
        let start = good
            .windows(marker.len())
            .position(|w| w == marker)
            .unwrap()
            + marker.len();
        // 15 bytes a vertex; 21 and 17 bytes for the faces.
        for length in start..good.len() {
            let error = TriangleMesh::from_ply(&good[..length]).unwrap_err();
            let into = length - start;
            let (element, index, byte) = match into {
                0..75 => ("vertex", into / 15, start + into / 15 * 15),
                75..96 => ("face", 0, start + 75),
                _ => ("face", 1, start + 96),
            };
            let place = Place::Element {
                element,
                index,
                byte: byte as u64,
            };
            assert_eq!(error, MeshError::Truncated { place }, "{length}");
        }
        let mut long = good.clone();
        long.push(7);
        let byte = good.len() as u64;
        assert_eq!(
            TriangleMesh::from_ply(&long),
            Err(MeshError::TrailingBytes { byte })
        );
        // A NaN in the second vertex, an index in the second face, and a count that cannot be.
        let with = |at: usize, bytes: &[u8]| {
            let mut bytes = bytes.to_vec();
            if big_endian {
                bytes.reverse();
            }
            let mut file = good.clone();
            file[start + at..start + at + bytes.len()].copy_from_slice(&bytes);
            TriangleMesh::from_ply(&file).unwrap_err()
        };
        let error = with(15, &f32::NAN.to_le_bytes());
        assert_eq!(error, MeshError::NonFiniteVertex { vertex: 1 });
        let error = with(98, &5_i32.to_le_bytes());
        let place = Place::Element {
            element: "face",
            index: 1,
            byte: start as u64 + 96,
        };
        assert_eq!(
            error,
            MeshError::FaceVertex {
                place,
                index: 5,
                vertices: 5
            }
        );
        assert_eq!(
            error.to_string(),
            format!(
                "face 1 (byte {}): the face names vertex 5, but there are 5 (counted from 0)",
                start + 96
            )
        );
        assert!(matches!(
            with(75, &[0xff, 0xff]),
            MeshError::Truncated { .. }
        ));
        // A list of so many flags, whose count is signed.
        let place = Place::Element {
            element: "face",
            index: 0,
            byte: start as u64 + 75,
        };
        let count = -2;
        assert_eq!(with(93, &[0xfe]), MeshError::NegativeCount { place, count });
        // A square that is bent.
        let error = with(14, &[100]);
        assert!(matches!(
            error,
            MeshError::Polygon {
                problem: PolygonProblem::NotPlanar,
                ..
            }
        ));
    }
}

#[test]
fn off_errors_name_the_line() {
    for (from, to, line) in [
        ("OFF", "4OFF", 1),
        ("OFF", "ply", 1),
        ("OFF #", "OFF BINARY #", 1),
        ("5 2 0", "5", 2),
        ("5 2 0", "5 -2 0", 2),
        ("1.5 0 0", "1.5 0", 4),
        ("1.5 0 0", "1.5 0 0 red", 4),
        ("5 2 0", "5 2 0 0", 2),
        ("5 2 0", "5 2 edges", 2),
        ("1.5 0 0", "1.5 0 0 0 0 1 1 0 0 1 0 0 0", 4),
        ("4 0 1 2 3", "four 0 1 2 3", 9),
        ("3 4 3 2", "3 4 3", 10),
        ("3 4 3 2", "3 4 3 2.5", 10),
        ("3 4 3 2\n", "", 10),
        ("3 4 3 2\n", "3 4 3 2\n3 4 3 2\n", 11),
        ("5 2 0", "4 2 0", 8),
        ("5 2 0", "18446744073709551615 2 0", 11),
    ] {
        let text = OFF.replacen(from, to, 1);
        assert_ne!(text, OFF);
        let error = off(&text).unwrap_err();
        let found = match error {
            MeshError::Syntax { line, .. } => line,
            // One vertex fewer makes the last one a face.
            MeshError::FaceVertex {
                place: Place::Line(line),
                ..
            } => line,
            _ => 0,
        };
        assert_eq!(found, line, "{from} -> {to}: {error:?}");
    }
    let place = Place::Line(10);
    assert_eq!(
        off(&OFF.replace("3 4 3 2", "3 4 3 5")),
        Err(MeshError::FaceVertex {
            place,
            index: 5,
            vertices: 5
        })
    );
    assert_eq!(
        off(&OFF.replace("3 4 3 2", "4 4 3 2 1")),
        Err(MeshError::Polygon {
            place,
            problem: PolygonProblem::NotPlanar
        })
    );
    assert_eq!(off("OFF 0 0 0"), Err(MeshError::Empty));
    // All on one line.
    let error = off("OFF 3 1 0 0 0 0 1 0 0 0 1 0 3 0 1 2").unwrap_err();
    let expected = "line 1: expected the counts on a line of their own, then one vertex or face a line, found ";
    assert!(error.to_string().starts_with(expected), "{error}");
    // What is passed over need not be finite.
    let normals = "NOFF\n3 1 0\n0 0 0 nan nan nan\n1 0 0 0 0 1\n0 1 0 0 0 inf\n3 0 1 2\n";
    assert_eq!(off(normals).unwrap().len(), 1);
    assert!(matches!(
        off(""),
        Err(MeshError::Syntax { line: 1 | 2, .. })
    ));
}
