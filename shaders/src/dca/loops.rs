//! Kernels of closed loops and coupled joints, over tables of groups of loops that move the same joints.
//!
//! A group has one workgroup. Its words are [`GROUP`] for itself, [`MEMBER`] a body, [`CONSTRAINT`] a loop or
//! coupling and [`EQUATION`] a row of J, with lists beside them; `memory.wgsl` says what they are.

use vertebra_gpu::{Binding, Kernel};

use super::{Advance, Dca, Layer, Sizes, advancing};
use crate::Precision;
use crate::parts::{JOINT, ROTATION, SPATIAL};

/// Words of a group.
pub const GROUP: u32 = 14;
/// Words of a body of a group.
pub const MEMBER: u32 = 5;
/// Words of a loop or coupling.
pub const CONSTRAINT: u32 = 13;
/// Words of an equation.
pub const EQUATION: u32 = 7;

/// Numbers that are kept of a body of a group.
pub const BODY_NUMBERS: u32 = 60;
/// Numbers that are kept of a freedom.
pub const FREEDOM_NUMBERS: u32 = 8;
/// Numbers that are kept of a row, beside its entries.
pub const ROW_NUMBERS: u32 = 6;

/// Equations of a group at most: what they ask for is kept on chip.
pub const MOST_ROWS: u32 = 1024;

/// Numbers and equations of a group that is worked on on chip, at most.
pub const ON_CHIP: (u32, u32) = (1792, 128);

/// Kinds of equations; the axes of both frames follow from the fourth bit on, two bits each.
pub mod equation {
    /// The second origin has coordinate zero along an axis of the first frame.
    pub const POINT: u32 = 0;
    /// Two axes are perpendicular.
    pub const PERPENDICULAR: u32 = 1;
    /// The second frame slides in proportion to its turn.
    pub const SCREW: u32 = 2;
    /// The origins are a distance apart.
    pub const DISTANCE: u32 = 3;
    /// A joint follows another.
    pub const COUPLING: u32 = 4;
}

/// What is put right, as [`Layer::ways`] of [`Dca::close_loops`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Closing {
    /// Accelerations under the loops' forces.
    Accelerations = 0,
    /// Positions, then rates, of the state that is worked on.
    Positions = 1,
}

/// Bit of [`Layer::sweep`] of [`Dca::close_loops`]: half of the loops' forces that go with the rates act, as closing the
/// loops makes up for the rest.
pub const HALF_TURNING: u32 = 1;
/// Likewise: a step starts, which it does not from loops that are wide open.
pub const STARTS: u32 = 2;

/// Lanes of a workgroup.
const LANES: u32 = 64;

macro_rules! part {
    ($name:literal) => {
        include_str!(concat!("../../wgsl/loops/", $name, ".wgsl"))
    };
}

const BINDINGS: &[Binding] = &[
    Binding::uniform::<Sizes>("sizes"),
    Binding::uniform::<Layer>("layer"),
    Binding::read::<u32>("words"),
    Binding::read::<[f32; 4]>("links"),
    Binding::read_write::<f32>("state"),
    Binding::read_write::<[f32; 4]>("scratch"),
    Binding::read_write::<u32>("control"),
    Binding::read_write::<u32>("status"),
    Binding::read::<f32>("forces"),
    Binding::read_write::<f32>("loops"),
];

const PARTS: &[&str] = &[
    SPATIAL,
    ROTATION,
    JOINT,
    include_str!("../../wgsl/dca/memory.wgsl"),
    include_str!("../../wgsl/dca/place.wgsl"),
    include_str!("../../wgsl/dca/poses_none.wgsl"),
    include_str!("../../wgsl/dca/forces.wgsl"),
    include_str!("../../wgsl/dca/copy.wgsl"),
    include_str!("../../wgsl/dca/advance.wgsl"),
    part!("bindings"),
];

impl Dca {
    /// Closes loops, a workgroup a group; [`Layer::starts`] is the first of the words that say where groups start. On
    /// chip are groups of at most [`ON_CHIP`], others of [`MOST_ROWS`].
    #[must_use]
    pub fn close_loops(self, on_chip: bool) -> Kernel {
        let constants = match self.chunks {
            Precision::F32 => part!("constants_f32"),
            Precision::F64 => part!("constants_f64"),
        };
        let parts = [
            part!("memory"),
            part!("place"),
            part!("equations"),
            part!("factor"),
            part!("respond"),
            part!("move"),
            part!("work"),
            part!("close_loops"),
        ];
        let (memory, numbers, rows) = if on_chip {
            (part!("memory_chip"), ON_CHIP.0, ON_CHIP.1)
        } else {
            (part!("memory_far"), 0, MOST_ROWS)
        };
        let counts = [
            ("BODY", BODY_NUMBERS),
            ("FREEDOM", FREEDOM_NUMBERS),
            ("ROW", ROW_NUMBERS),
            ("MOST_ROWS", rows),
            ("CHIP", numbers),
        ];
        let counts = counts.map(|(name, count)| format!("const {name} = {count}u;\n"));
        let elements = if self.elements {
            part!("elements")
        } else {
            part!("elements_none")
        };
        let along = if self.balls {
            part!("along_moments")
        } else {
            part!("along_axes")
        };
        let varying = [self.epsilon(), constants, memory, elements, along];
        let parts = parts.into_iter().chain(varying);
        let kernel = parts
            .fold(self.looped("close_loops"), Kernel::with)
            .with_text(counts.concat());
        self.sharing(kernel, (numbers + rows + LANES) * self.chunks.bytes() + 4)
    }

    /// The integrator on its own, a lane a body.
    #[must_use]
    pub fn advance_joints(self, advance: Advance) -> Kernel {
        let kernel = self.looped("advance_joints");
        advancing(kernel.with(part!("advance_joints")), advance)
    }

    /// All of them.
    pub(super) fn loop_kernels(self) -> [Kernel; 4] {
        [
            self.close_loops(true),
            self.close_loops(false),
            self.advance_joints(Advance::Euler),
            self.advance_joints(Advance::RungeKutta),
        ]
    }

    fn looped(self, name: &'static str) -> Kernel {
        let kernel = Kernel::new(name, PARTS, BINDINGS, [LANES, 1, 1]);
        let kernel = self.sharing(kernel, 0);
        let kernel = kernel.with(self.attempts()).with(self.pitch());
        let kernel = if self.elements {
            self.with_elements(kernel)
        } else {
            let kernel = kernel.with_text(self.works());
            kernel.with(include_str!("../../wgsl/dca/settle_none.wgsl"))
        };
        self.precise(kernel, self.chunks)
            .stride("forces", self.chunks.bytes())
            .stride("loops", self.chunks.bytes())
    }
}
