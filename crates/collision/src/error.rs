//! Errors, each naming the culprit and the remedy.

use std::io;
use std::path::PathBuf;

/// Why a mesh was refused.
///
/// Lines count from 1; vertices, triangles, facets and byte offsets from 0.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// Something is wrong with a file.
    #[error("the mesh file {} cannot be used: {error}", path.display())]
    InFile {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        error: Box<Self>,
    },
    /// The file could not be read.
    #[error("cannot be read ({kind}): check the path, the permissions and the free memory")]
    Read {
        /// What the operating system said.
        kind: io::ErrorKind,
    },
    /// The extension names no format that can be read.
    #[error("unknown mesh format: the file name must end in .obj, .stl, .ply or .off")]
    UnknownExtension,
    /// The mesh has no triangle.
    #[error("empty mesh: at least one triangle is needed")]
    Empty,
    /// More vertices or triangles than 32-bit indices can name.
    #[error("{count} {element} are too many for 32-bit indices: split the mesh")]
    TooMany {
        /// "vertices" or "triangles".
        element: &'static str,
        /// How many there are.
        count: usize,
    },
    /// A vertex coordinate is NaN or infinite.
    #[error("vertex {vertex} has a coordinate that is not finite: repair or remove it")]
    NonFiniteVertex {
        /// Index of the vertex.
        vertex: usize,
    },
    /// Vertices were to be moved, but there are not as many as before.
    #[error("{found} vertices cannot replace {expected}: to change their number, make a new mesh")]
    VertexCount {
        /// How many there are.
        expected: usize,
        /// How many were given.
        found: usize,
    },
    /// A triangle names a vertex that is not there.
    #[error(
        "triangle {triangle} names vertex {index}, but there are {vertices} vertices (counted from 0)"
    )]
    IndexOutOfRange {
        /// Index of the triangle.
        triangle: usize,
        /// The vertex index it holds.
        index: u32,
        /// How many vertices there are.
        vertices: usize,
    },
    /// A line of a text file does not say what it should.
    #[error("line {line}: expected {expected}, found `{found}`")]
    Syntax {
        /// The line.
        line: usize,
        /// What should be there.
        expected: &'static str,
        /// What is there, shortened.
        found: String,
    },
    /// A coordinate in a text file is NaN, infinite, or beyond the range of `f32`.
    #[error(
        "line {line}: `{found}` is not a finite coordinate (at most 3.4e38): use a larger unit of length or repair it"
    )]
    NonFiniteCoordinate {
        /// The line.
        line: usize,
        /// The coordinate as written, shortened.
        found: String,
    },
    /// A face of an OBJ file names a vertex that is not there.
    #[error(
        "line {line}: the face names vertex {index}, but there are {vertices} (counted from 1, negative from the end)"
    )]
    FaceIndex {
        /// The line.
        line: usize,
        /// The index as written.
        index: i64,
        /// How many vertices it may refer to.
        vertices: usize,
    },
    /// A face of a PLY or OFF file names a vertex that is not there.
    #[error("{place}: the face names vertex {index}, but there are {vertices} (counted from 0)")]
    FaceVertex {
        /// The face.
        place: Place,
        /// The index as written.
        index: i64,
        /// How many vertices there are.
        vertices: usize,
    },
    /// A list in a PLY file has less than nothing in it.
    #[error("{place}: a list cannot have {count} entries: the file is damaged, export it again")]
    NegativeCount {
        /// The element that has it.
        place: Place,
        /// The count as written.
        count: i64,
    },
    /// A polygon cannot be divided into triangles without changing or guessing its shape.
    #[error("{place}: {problem}; triangulate the mesh when exporting it")]
    Polygon {
        /// The face.
        place: Place,
        /// What is wrong with it.
        problem: PolygonProblem,
    },
    /// A binary PLY file ends too early.
    #[error("the file ends within {place}: it is damaged or incomplete, export it again")]
    Truncated {
        /// The element that is incomplete.
        place: Place,
    },
    /// A binary PLY file goes on after what its header announces.
    #[error(
        "the last element ends at byte {byte}, but the file does not: it is damaged, export it again"
    )]
    TrailingBytes {
        /// Where the last element ends.
        byte: u64,
    },
    /// A binary STL file is not as long as its facet count says.
    #[error(
        "binary STL of {facets} facets must have {expected} bytes, found {found} \
         (the facet count is at byte 80): the file is damaged or incomplete, export it again"
    )]
    StlLength {
        /// Facets according to the header.
        facets: u32,
        /// The length that follows \[bytes].
        expected: u64,
        /// The length of the file \[bytes].
        found: u64,
    },
    /// A file is too short to be STL.
    #[error(
        "an STL file has at least 84 bytes (binary) or starts with `solid` (text), found {found} bytes: \
         the file is damaged or incomplete, export it again"
    )]
    StlHeader {
        /// The length of the file \[bytes].
        found: u64,
    },
    /// A vertex of a binary STL file is NaN or infinite.
    #[error(
        "facet {facet} (byte {offset}) has a coordinate that is not finite: repair or remove it"
    )]
    StlNonFinite {
        /// Index of the facet.
        facet: usize,
        /// Byte where the facet starts.
        offset: u64,
    },
}

/// Where in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Place {
    /// A line of a text file.
    Line(usize),
    /// An element of a binary file.
    Element {
        /// "vertex", "face", or "element" for others.
        element: &'static str,
        /// Its index among those of its kind.
        index: usize,
        /// The byte where it starts.
        byte: u64,
    },
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Line(line) => write!(f, "line {line}"),
            Self::Element {
                element,
                index,
                byte,
            } => write!(f, "{element} {index} (byte {byte})"),
        }
    }
}

/// Why a polygon cannot be divided into triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PolygonProblem {
    /// A face of one or two vertices.
    #[error("a face needs at least 3 vertices")]
    TooFewVertices,
    /// The vertices do not lie in a plane.
    #[error("the polygon is not planar")]
    NotPlanar,
    /// The polygon has a reflex corner or crosses itself.
    #[error("the polygon is not convex")]
    NotConvex,
    /// The polygon has no area, hence no inside.
    #[error("the polygon has zero area")]
    ZeroArea,
}

/// Why a query was refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum QueryError {
    /// A pose is unusable.
    #[error("the pose of mesh {mesh} {problem}")]
    InvalidPose {
        /// Whose pose.
        mesh: Side,
        /// What is wrong with it.
        problem: PoseProblem,
    },
    /// The tolerance of Möller's test is unusable.
    #[error("the tolerance {epsilon} of Möller's test must be finite and not negative")]
    InvalidEpsilon {
        /// The tolerance given.
        epsilon: f32,
    },
    /// More than pairs was asked of a method that has no more.
    #[error("only exact pairs have classes, curves and distances: ask with Method::Exact")]
    NotExact,
    /// A distance that is none.
    #[error("the distance {distance} must be finite, not negative and below 1.7e38")]
    InvalidDistance {
        /// The distance given \[m].
        distance: f64,
    },
    /// A point is NaN or infinite.
    #[error("the point {point:?} has a coordinate that is not finite")]
    NonFinitePoint {
        /// The point given \[m].
        point: [f64; 3],
    },
    /// A mesh without inside.
    #[error(
        "the mesh is not closed: the side from vertex {} to {} of triangle {triangle} belongs to an odd number of \
         triangles; close the hole or remove what stands out", side[0], side[1]
    )]
    NotClosed {
        /// A triangle with such a side.
        triangle: u32,
        /// The vertices of the side.
        side: [u32; 2],
    },
    /// A body that is not there.
    #[error("there is no body {body}: there are {bodies}, counted from 0")]
    NoSuchBody {
        /// The index given.
        body: usize,
        /// How many there are.
        bodies: usize,
    },
    /// A body is no pair with itself.
    #[error("body {body} and body {body} are one: a pair to leave out needs two bodies")]
    SameBody {
        /// The index given twice.
        body: usize,
    },
    /// A configuration does not place every body.
    #[error("configuration {configuration} has {found} poses for {expected} bodies")]
    PoseCount {
        /// Index of the configuration.
        configuration: usize,
        /// The number of bodies.
        expected: usize,
        /// The number of poses.
        found: usize,
    },
    /// A question about one of many poses failed.
    #[error("the question about pose {index} failed")]
    AtPose {
        /// Index of the pose.
        index: usize,
        /// What went wrong.
        #[source]
        error: Box<Self>,
    },
    /// A question about one of many pairs of bodies failed.
    #[error(
        "the question about bodies {} and {} in configuration {configuration} failed", pair[0], pair[1]
    )]
    InPair {
        /// Index of the configuration.
        configuration: usize,
        /// The bodies, A first.
        pair: [usize; 2],
        /// What went wrong.
        #[source]
        error: Box<Self>,
    },
}

/// One of the two meshes of a query.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The first mesh.
    A,
    /// The second mesh.
    B,
}

impl std::fmt::Display for Side {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::A => "A",
            Self::B => "B",
        })
    }
}

/// What is wrong with a pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PoseProblem {
    /// NaN or an infinity.
    #[error("has a number that is not finite")]
    NotFinite,
    /// The quaternion's length differs from 1 by more than 1e-6.
    #[error("has a rotation whose quaternion is not of unit length: normalise it")]
    NotUnit,
    /// A component of the translation is 2^127 or more.
    #[error("has a translation of 1.7e38 or more, beyond what meshes in f32 reach")]
    TooFar,
}
