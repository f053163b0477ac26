//! Kernels of divide and conquer, over the tables that `vertebra-dynamics` makes of an assembly tree.
//!
//! Kernels of one group have one list of bindings: those of motion (`turn_*`, `place_*`) write poses,
//! those of dynamics read forces and work on nodes.

pub mod loops;

use bytemuck::{Pod, Zeroable};
use vertebra_gpu::{Binding, Kernel};

use crate::Precision;
use crate::parts::{BALLS, CHOLESKY, ELEMENTS, JOINT, ROTATION, ROTATION_LOG, SPATIAL};

/// Numbers of everything, and where tables start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Sizes {
    /// Bodies.
    pub slots: u32,
    /// Numbers in q.
    pub positions: u32,
    /// Numbers in qd.
    pub dofs: u32,
    /// Chunks.
    pub chunks: u32,
    /// Joins.
    pub joins: u32,
    /// Nodes of chunks, which are before those of joins.
    pub chunk_nodes: u32,
    /// Chunks that start at a cut body.
    pub inners: u32,
    /// Chunks that end with a leaf.
    pub leaves: u32,
    /// Side branches and sums of them.
    pub rakes: u32,
    /// 1 if bodies carry others' paths, else 0.
    pub carriers: u32,
    /// 1 if every joint has one freedom, else 0.
    pub single: u32,
    /// First word of the tables of chunks.
    pub chunk_words: u32,
    /// First word of the table of cut bodies.
    pub cut_words: u32,
    /// First word of the table of sums.
    pub sum_words: u32,
    /// First word of the table of rakes.
    pub rake_words: u32,
    /// Metres in the model's unit of length.
    pub length: f32,
    /// First number of the forces that says what pushes bodies.
    pub pushes: u32,
    /// First four of the scratch memory that says what acts in spherical joints, if [`Dca::balls`].
    pub balls: u32,
}

/// What a dispatch works on: chunks a lane each, or several rounds of the tree.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Layer {
    /// Number of chunks; of workgroups that have something to do.
    pub count: u32,
    /// Number of rounds.
    pub rounds: u32,
    /// First word of the table: for each workgroup where the items of its rounds start, and end.
    pub starts: u32,
    /// [`Way`], as a number.
    pub ways: u32,
    /// [`Commit`] or the stage of an integrator, as a number.
    pub stage: u32,
    /// 0 for a solution, then the number of the correction.
    pub sweep: u32,
    /// Which solution of a step it is that is implicit in what acts in joints, from 1 to [`MOST_ATTEMPTS`]; 0
    /// where that acts as it does now.
    pub attempt: u32,
}

/// What becomes of the state before its rotations are computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Commit {
    /// A stage of an integrator: nothing.
    Keep = 0,
    /// The state worked on becomes the state, if the step has not failed.
    Step = 1,
    /// The state is taken to be worked on.
    Restore = 2,
}

/// What accelerations are for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Advance {
    /// Themselves.
    None,
    /// A semi-implicit Euler step.
    Euler,
    /// A stage of a Runge-Kutta step; [`Layer::stage`] says which, 0 to 3.
    RungeKutta,
}

/// Which ways a dispatch goes through its rounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Way {
    /// From the chunks to the roots.
    Up = 1,
    /// Back.
    Down = 2,
    /// One after the other.
    Both = 3,
}

/// Kinds of the items of a table of rounds but for joins, in the lowest two bits of their words.
pub mod item {
    /// A chunk.
    pub const CHUNK: u32 = 0;
    /// A sum of two rakes.
    pub const SUM: u32 = 1;
    /// A chunk of the first round, in kinematics.
    pub const LEADING: u32 = 2;
}

/// Solutions of a step at most that find out on which parts laws of elements are.
pub const MOST_ATTEMPTS: u32 = 12;

/// Numbers of a freedom among the forces where elements act: the joint force, inertia of its own, and of a motor
/// its force at position and rate zero, the position it strives for, its gains, and its limit. A spherical joint's three
/// freedoms share those of its motor: the torque, x, y and z of the orientation, w and the stiffness, the damping, the
/// limit.
pub const DRIVEN_NUMBERS: usize = 7;
/// One more of models with [`Dca::balls`]: what a spherical joint's own inertia has off its diagonal.
pub const BALL_NUMBERS: usize = 1;

/// Rows of numbers of a body where elements act, and more of models with [`Dca::balls`].
pub const ELEMENT_ROWS: usize = 3;
/// These.
pub const BALL_ROWS: usize = 2;

/// Fours of a freedom in the scratch memory where spherical joints are loaded by [`Dca::load_balls`].
pub const BALL_FOURS: u32 = 2;

/// What [`Dca::load_balls`] does, bits of [`Layer::ways`].
pub mod balls {
    /// Forces and inertia for the solution that comes.
    pub const LOADS: u32 = 1;
    /// The parts of laws that the last solution asks for.
    pub const FOLLOWS: u32 = 2;
    /// The work of the step.
    pub const ACCOUNTS: u32 = 4;
}

/// Sums of work that are kept of each freedom: of motors, springs, dampers, friction and stops. One of loops follows where
/// there are any.
pub const WORKS: usize = 5;

/// Words of a join in a table of rounds.
pub const RECORD: u32 = 10;

/// Lanes of a workgroup that goes through rounds of joins.
pub const WORK_LANES: u32 = 256;
/// Lanes that share a join there.
pub const TEAM: u32 = 16;
/// Lanes of a workgroup that goes through rounds of kinematics.
pub const TURN_LANES: u32 = 256;

/// Lanes of a workgroup of chunks, and of one that goes through rounds of any kind: these take registers.
const CHUNK_LANES: u32 = 32;
const MIXED_LANES: u32 = 128;

/// Numbers of workgroup memory that a join takes.
const JOIN_MEMORY: u32 = 92 + 92;

/// Joins of a workgroup that have a place on chip for what they hand to others, and the word of those that have none.
pub const PLACES: u32 = 96;
/// See [`PLACES`].
pub const NOWHERE: u32 = 255;

/// Bytes of what tables say of a workgroup's joins, by places, and of its rounds.
const TABLE_MEMORY: u32 = 4 * (RECORD * PLACES + PLACES + 1);

/// Numbers of such a place: of forces between parts; where vectors go up, of b1 and b2.
const HANDED_DOWN: u32 = 6;
const HANDED_UP: u32 = 12;

macro_rules! part {
    ($name:literal) => {
        include_str!(concat!("../wgsl/dca/", $name, ".wgsl"))
    };
}

const MOTION: &[Binding] = &[
    Binding::uniform::<Sizes>("sizes"),
    Binding::uniform::<Layer>("layer"),
    Binding::read::<u32>("words"),
    Binding::read::<[f32; 4]>("links"),
    Binding::read_write::<f32>("state"),
    Binding::read_write::<[f32; 4]>("scratch"),
    Binding::read_write::<u32>("control"),
    Binding::read_write::<u32>("status"),
    Binding::read_write::<[f32; 4]>("poses"),
];

const DYNAMICS: &[Binding] = &[
    Binding::uniform::<Sizes>("sizes"),
    Binding::uniform::<Layer>("layer"),
    Binding::read::<u32>("words"),
    Binding::read::<[f32; 4]>("links"),
    Binding::read_write::<f32>("state"),
    Binding::read_write::<[f32; 4]>("scratch"),
    Binding::read_write::<u32>("control"),
    Binding::read_write::<u32>("status"),
    Binding::read::<f32>("forces"),
    Binding::read_write::<[f32; 4]>("nodes"),
];

const ACTING: &[Binding] = &[
    Binding::uniform::<Sizes>("sizes"),
    Binding::uniform::<Layer>("layer"),
    Binding::read::<u32>("words"),
    Binding::read::<[f32; 4]>("links"),
    Binding::read_write::<f32>("state"),
    Binding::read_write::<[f32; 4]>("scratch"),
    Binding::read_write::<u32>("control"),
    Binding::read_write::<u32>("status"),
    Binding::read::<f32>("forces"),
];

const ACTING_PARTS: &[&str] = &[
    SPATIAL,
    ROTATION,
    JOINT,
    part!("memory"),
    part!("forces"),
    part!("advance"),
];

const MOTION_PARTS: &[&str] = &[
    SPATIAL,
    ROTATION,
    JOINT,
    part!("memory"),
    part!("place"),
    part!("poses"),
];

const DYNAMICS_PARTS: &[&str] = &[
    SPATIAL,
    CHOLESKY,
    ROTATION,
    JOINT,
    part!("memory"),
    part!("place"),
    part!("poses_none"),
    part!("matrix6"),
    part!("join"),
    part!("forces"),
    part!("nodes"),
    part!("rake"),
];

/// The kernels in one choice of precisions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Dca {
    /// Precision of kinematics, chunks and the state.
    pub chunks: Precision,
    /// Precision of the joins, at most that of the chunks.
    pub tree: Precision,
    /// Whether chunks end with leaves.
    pub leaves: bool,
    /// Whether joints have several freedoms.
    pub several: bool,
    /// Whether anything acts in joints but the forces given.
    pub elements: bool,
    /// Whether spherical joints have ranges, friction or motors.
    pub balls: bool,
    /// Whether joints are screws.
    pub screws: bool,
    /// Whether loops are closed.
    pub loops: bool,
    /// Whether solutions are corrected.
    pub refined: bool,
}

impl Dca {
    /// Of everything there is, in all precisions.
    const ALL: [Self; 3] = [
        Self::of(Precision::F32, Precision::F32),
        Self::of(Precision::F64, Precision::F32),
        Self::of(Precision::F64, Precision::F64),
    ];

    const fn of(chunks: Precision, tree: Precision) -> Self {
        Self {
            chunks,
            tree,
            leaves: true,
            several: true,
            elements: true,
            balls: true,
            screws: true,
            loops: true,
            refined: false,
        }
    }

    /// Kinematics over several rounds. [`Layer::stage`] is a [`Commit`].
    #[must_use]
    pub fn turn_parts(self) -> Kernel {
        let kernel = self.motion("turn_parts", TURN_LANES);
        let kernel = kernel.with(part!("turn")).with(part!("turn_parts"));
        kernel
            .with(part!("copy"))
            .with(part!("rounds"))
            .with(part!("lanes"))
    }

    /// Places the bodies of the first round's chunks, a lane each.
    #[must_use]
    pub fn place_chunks(self) -> Kernel {
        let kernel = self.motion("place_chunks", 64);
        kernel.with(part!("place_chunks")).with(part!("leading"))
    }

    /// Places and assembles the first round's chunks, a lane each.
    #[must_use]
    pub fn assemble_chunks(self) -> Kernel {
        let kernel = self.dynamics("assemble_chunks", self.chunks, CHUNK_LANES);
        let kernel = self.with_chunks(kernel);
        let kernel = kernel.with(part!("advance_none")).with(part!("rakes_none"));
        kernel.with(part!("assemble_chunks")).with(part!("leading"))
    }

    /// What acts in spherical joints, a lane each, of [`Self::balls`]; [`Layer::starts`] is the first word of their
    /// slots' table, [`Layer::ways`] is made of [`balls`].
    #[must_use]
    pub fn load_balls(self) -> Kernel {
        let kernel = Kernel::new("load_balls", ACTING_PARTS, ACTING, [64, 1, 1]);
        let kernel = self.sharing(self.precise(kernel, self.chunks), 0);
        let parts = [self.attempts(), self.epsilon(), BALLS, part!("load_balls")];
        let kernel = parts.into_iter().fold(kernel, Kernel::with);
        let kernel = kernel.stride("forces", self.chunks.bytes());
        self.with_elements(kernel)
    }

    /// Solves the first round's chunks, a lane each.
    #[must_use]
    pub fn solve_chunks(self, advance: Advance) -> Kernel {
        let kernel = self.dynamics("solve_chunks", self.chunks, CHUNK_LANES);
        let kernel = self.with_chunks(kernel);
        let kernel = kernel.with(part!("solve_chunks")).with(part!("leading"));
        let kernel = kernel.with(part!("rakes_none"));
        advancing(kernel, advance)
    }

    /// Solves the first round's chunks before a correction, and gathers what is left of their bodies' equations.
    #[must_use]
    pub fn resolve_chunks(self) -> Kernel {
        let kernel = self.dynamics("resolve_chunks", self.chunks, CHUNK_LANES);
        let kernel = self.with_reassembly(self.with_chunks(kernel));
        let parts = [
            part!("resolve_chunks"),
            part!("leading"),
            part!("rakes_none"),
            part!("reassemble_rakes_none"),
        ];
        advancing(parts.into_iter().fold(kernel, Kernel::with), Advance::None)
    }

    /// Rounds of joins alone, in the precision of the tree.
    #[must_use]
    pub fn join_parts(self) -> Kernel {
        let kernel = self.joining("join_parts", self.tree, WORK_LANES, TABLE_MEMORY);
        alone(kernel).with(part!("join_rounds"))
    }

    /// Rounds of joins alone in a correction, in the precision of the tree.
    #[must_use]
    pub fn rejoin_parts(self) -> Kernel {
        let kernel = self.rejoining("rejoin_parts", self.tree, WORK_LANES, TABLE_MEMORY);
        alone(kernel).with(part!("rejoin_rounds"))
    }

    /// Rounds of any kind, joins too computed in the precision of the chunks.
    #[must_use]
    pub fn work_parts(self, advance: Advance) -> Kernel {
        let kernel = self.with_chunks(self.joining("work_parts", self.chunks, MIXED_LANES, 0));
        let kernel = mixed(kernel).with(part!("work_parts"));
        advancing(kernel.with(part!("rakes_onto")), advance)
    }

    /// Rounds of any kind in a correction, joins too computed in the precision of the chunks.
    #[must_use]
    pub fn rework_parts(self, advance: Advance) -> Kernel {
        let kernel = self.with_chunks(self.rejoining("rework_parts", self.chunks, MIXED_LANES, 0));
        let parts = [
            part!("rework_parts"),
            part!("rakes_none"),
            part!("reassemble_rakes"),
        ];
        let kernel = self.with_reassembly(mixed(kernel));
        advancing(parts.into_iter().fold(kernel, Kernel::with), advance)
    }

    /// Kernels of every kind, of all there is and of the least, with what they are.
    pub(crate) fn all() -> Vec<(String, Kernel)> {
        let contents = |dca: Self| {
            let alike = Self {
                balls: false,
                ..dca
            };
            let bare = Self {
                elements: false,
                screws: false,
                ..alike
            };
            let least = Self {
                leaves: false,
                several: false,
                loops: false,
                ..bare
            };
            // Those take the same parts in all precisions.
            let alike = (dca.chunks != dca.tree).then_some(alike);
            [Some(dca), alike, Some(bare), Some(least)]
                .into_iter()
                .flatten()
        };
        let choices = Self::ALL.into_iter().flat_map(contents);
        let refined = |dca: Self| {
            let is_precise = dca.chunks == Precision::F64;
            let refined = is_precise.then_some(Self {
                refined: true,
                ..dca
            });
            [Some(dca), refined].into_iter().flatten()
        };
        choices.flat_map(refined).flat_map(Self::kernels).collect()
    }

    /// All of them, with what they are.
    fn kernels(self) -> Vec<(String, Kernel)> {
        let mut kernels = vec![
            self.assemble_chunks(),
            self.solve_chunks(Advance::None),
            self.join_parts(),
        ];
        if self.refined {
            kernels.extend([
                self.resolve_chunks(),
                self.rejoin_parts(),
                self.work_parts(Advance::None),
                self.rework_parts(Advance::Euler),
            ]);
        } else {
            kernels.extend([self.turn_parts(), self.place_chunks()]);
            kernels.extend(self.balls.then(|| self.load_balls()));
            if self.loops {
                kernels.extend(self.loop_kernels());
            }
            let advances = [Advance::None, Advance::Euler, Advance::RungeKutta];
            kernels.extend(advances.map(|advance| self.work_parts(advance)));
        }
        let named = |(number, kernel): (usize, Kernel)| {
            let Self {
                chunks,
                tree,
                leaves,
                elements,
                balls,
                refined,
                ..
            } = self;
            let content = match (balls, elements, leaves) {
                (true, ..) => "all",
                (false, true, _) => "without balls",
                (_, false, true) => "bare",
                (_, false, false) => "least",
            };
            let kept = if refined { " refined" } else { "" };
            let name = format!(
                "{} {chunks:?} {tree:?} {content}{kept} {number}",
                kernel.name()
            );
            (name, kernel)
        };
        kernels.into_iter().enumerate().map(named).collect()
    }

    /// Rounding in the tree as multiples of rounding in the chunks.
    fn coarser(self) -> f64 {
        match (self.chunks, self.tree) {
            (Precision::F64, Precision::F32) => f64::from(f32::EPSILON) / f64::EPSILON,
            _ => 1.0,
        }
    }

    fn motion(self, name: &'static str, lanes: u32) -> Kernel {
        let kernel = Kernel::new(name, MOTION_PARTS, MOTION, [lanes, 1, 1]);
        let kernel = self.precise(kernel, self.chunks);
        let works = if self.elements || self.loops {
            part!("works")
        } else {
            part!("works_none")
        };
        let parts = [works, self.pitch(), part!("attempts_none")];
        let kernel = parts.into_iter().fold(kernel, Kernel::with);
        let kernel = kernel.with_text(self.works());
        kernel.stride("poses", 4 * self.chunks.bytes())
    }

    fn dynamics(self, name: &'static str, precision: Precision, lanes: u32) -> Kernel {
        let kernel = Kernel::new(name, DYNAMICS_PARTS, DYNAMICS, [lanes, 1, 1]);
        let kernel = self.precise(kernel, precision);
        let keep = if self.refined {
            part!("keep")
        } else {
            part!("keep_none")
        };
        self.sharing(kernel, 0)
            .with(keep)
            .with(self.attempts())
            .with(self.pitch())
            .stride("forces", self.chunks.bytes())
            .stride("nodes", 4 * self.tree.bytes())
    }

    /// Adds what chunks are worked on with, of what the model has.
    fn with_chunks(self, kernel: Kernel) -> Kernel {
        let leaf = if self.leaves {
            part!("leaf")
        } else {
            part!("leaf_none")
        };
        let several = if self.several {
            part!("several")
        } else {
            part!("several_none")
        };
        let screws = if self.screws {
            part!("screws")
        } else {
            part!("screws_none")
        };
        let parts = [part!("chunk"), part!("respond"), part!("advance")];
        let parts = parts
            .into_iter()
            .chain([self.epsilon(), leaf, several, screws]);
        let kernel = parts.fold(kernel, Kernel::with);
        if self.elements {
            return self.with_elements(kernel);
        }
        kernel.with(part!("loads_none")).with(part!("settle_none"))
    }

    /// Adds what acts in joints.
    fn with_elements(self, kernel: Kernel) -> Kernel {
        let turning = if self.balls {
            part!("turning")
        } else {
            part!("turning_alike")
        };
        let parts = [ROTATION_LOG, ELEMENTS, part!("loads"), part!("settle")];
        let parts = parts.into_iter().chain([turning]);
        parts
            .fold(kernel, Kernel::with)
            .constant("SOLVED_TO", self.tree.epsilon())
            .constant("FIRMNESS", 0.1 / self.tree.epsilon().sqrt())
            .constant("MOST_ATTEMPTS", MOST_ATTEMPTS)
            .with_text(self.works())
    }

    /// How many sums of work are kept of a freedom.
    fn works(self) -> String {
        format!("const WORKS = {}u;\n", WORKS + usize::from(self.loops))
    }

    /// Rounding of the chunks.
    const fn epsilon(self) -> &'static str {
        match self.chunks {
            Precision::F32 => part!("epsilon_f32"),
            Precision::F64 => part!("epsilon_f64"),
        }
    }

    /// Whether a dispatch is one of several that a step may need.
    const fn attempts(self) -> &'static str {
        if self.elements {
            part!("attempts")
        } else {
            part!("attempts_none")
        }
    }

    /// Adds what chunks are corrected with, of what the model has.
    fn with_reassembly(self, kernel: Kernel) -> Kernel {
        let leaf = if self.leaves {
            part!("reassemble_leaf")
        } else {
            part!("reassemble_leaf_none")
        };
        let several = if self.several {
            part!("reassemble_several")
        } else {
            part!("reassemble_several_none")
        };
        [part!("reassemble"), leaf, several]
            .into_iter()
            .fold(kernel, Kernel::with)
    }

    /// What pitches screws have.
    const fn pitch(self) -> &'static str {
        if self.screws {
            part!("pitch")
        } else {
            part!("pitch_none")
        }
    }

    /// With so much workgroup memory \[bytes\], and what attempts share.
    const fn sharing(self, kernel: Kernel, bytes: u32) -> Kernel {
        let attempts = if self.elements { 4 } else { 0 };
        kernel.workgroup_memory_of(bytes + attempts)
    }

    /// Rounds whose joins are put together.
    fn joining(self, name: &'static str, precision: Precision, lanes: u32, more: u32) -> Kernel {
        let joins = lanes / TEAM;
        let kernel = self.teams(name, precision, lanes).with(part!("join_team"));
        let kernel = kernel.constant("COARSER", self.coarser());
        let handed = HANDED_DOWN * PLACES * self.tree.bytes();
        let pairs = joins * JOIN_MEMORY * precision.bytes();
        self.sharing(kernel, pairs + handed + more)
    }

    /// Rounds whose joins are corrected.
    fn rejoining(self, name: &'static str, precision: Precision, lanes: u32, more: u32) -> Kernel {
        let kernel = self.teams(name, precision, lanes);
        let kernel = kernel.with(part!("rejoin_team")).with(part!("change"));
        let handed = HANDED_UP * PLACES * self.tree.bytes();
        self.sharing(kernel, handed + more)
    }

    /// Rounds, joins of which teams of lanes take.
    fn teams(self, name: &'static str, precision: Precision, lanes: u32) -> Kernel {
        self.dynamics(name, precision, lanes)
            .with(part!("seams"))
            .with(part!("part_team"))
    }

    fn precise(self, kernel: Kernel, precision: Precision) -> Kernel {
        let kept = match (self.chunks, self.tree) {
            (Precision::F32, _) => "alias chunk_real = f32;\nalias tree_real = f32;\n",
            (Precision::F64, Precision::F32) => "alias chunk_real = f64;\nalias tree_real = f32;\n",
            (Precision::F64, Precision::F64) => "alias chunk_real = f64;\nalias tree_real = f64;\n",
        };
        kernel
            .with(precision.part())
            .with(precision.trigonometry())
            .with(kept)
            .stride("links", 4 * self.chunks.bytes())
            .stride("state", self.chunks.bytes())
            .stride("scratch", 4 * self.chunks.bytes())
            .requires(self.chunks.features() | self.tree.features())
    }
}

/// Rounds in which there is nothing but joins.
fn alone(kernel: Kernel) -> Kernel {
    kernel.with(part!("join_parts"))
}

/// Rounds in which there is more than joins.
fn mixed(kernel: Kernel) -> Kernel {
    kernel.with(part!("rounds")).with(part!("teams"))
}

fn advancing(kernel: Kernel, advance: Advance) -> Kernel {
    match advance {
        Advance::None => kernel.with(part!("advance_none")),
        Advance::Euler => kernel.with(part!("advance_euler")),
        Advance::RungeKutta => kernel.with(part!("advance_runge_kutta")),
    }
}
