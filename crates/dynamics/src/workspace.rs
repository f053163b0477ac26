//! Scratch and results of the algorithms.

use crate::balance::least_acceleration;
use crate::correct::Corrections;
use crate::derivatives::Tangents;
use crate::link::{BodyFrame, Link, Scales};
use crate::loops::{first_loop, refuse_looped};
use crate::own::OwnInertia;
use crate::substitute::Substitution;
use crate::{Error, Forces, Precision};
use glam::{DQuat, DVec3};
use vertebra_assembly::{BodyId, Model, Units};
use vertebra_spatial::{
    ArticulatedInertia, DoubleDouble, Force, Mat3, Motion, Number, Pose, Real, RigidInertia,
    SmallCholesky, Vec3,
};

/// Memory in which the algorithms work and leave their results, made for one model and precision.
///
/// All memory is taken when it is made, but for the mass matrix and that of
/// [corrections](crate::refine), which are taken when first asked for.
#[derive(Clone, Debug)]
pub struct Workspace {
    pub(crate) model: Model,
    pub(crate) scales: Scales,
    pub(crate) arrays: Arrays,
    pub(crate) computed: Computed,
    /// Time of the state that was set last \[s\], its positions and rates.
    pub(crate) time: f64,
    pub(crate) q: Vec<f64>,
    pub(crate) qd: Vec<f64>,
    /// [`largest_push`](crate::balance::largest_push) of the last solution.
    pub(crate) push: f64,
    /// Joint accelerations [rad/s^2 or m/s^2].
    pub(crate) qdd: Vec<f64>,
    /// Joint forces [N m or N].
    pub(crate) tau: Vec<f64>,
    /// Mass matrix by columns, once it has been asked for.
    pub(crate) mass_matrix: Vec<f64>,
    /// The first loop or coupling, if the model has any and is not taken as a tree.
    looped: Option<String>,
}

/// Velocity [rad/s, m/s] or acceleration [rad/s^2, m/s^2] of a body, in world axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BodyMotion {
    /// Angular part.
    pub angular: DVec3,
    /// Linear part: that of the body's point at the origin of its frame.
    pub linear: DVec3,
}

impl BodyMotion {
    fn is_finite(&self) -> bool {
        self.angular.is_finite() && self.linear.is_finite()
    }
}

/// Force on a body, in world axes about the origin of its joint.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BodyForce {
    /// Moment [N m].
    pub moment: DVec3,
    /// Force \[N\].
    pub force: DVec3,
}

impl BodyForce {
    /// From the model's units, if the result is finite.
    pub(crate) fn in_si(force: Force<f64>, units: &Units) -> Option<Self> {
        let wrench = Self {
            moment: force.angular.to_glam() * units.energy(),
            force: force.linear.to_glam() * units.force(),
        };
        (wrench.moment.is_finite() && wrench.force.is_finite()).then_some(wrench)
    }
}

/// Which results are those of the last state given.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Computed {
    pub(crate) state: bool,
    pub(crate) poses: bool,
    pub(crate) accelerations: bool,
    pub(crate) joint_wrenches: bool,
    /// Whether the solution has been corrected since: of pA only that [where runs start](crate::correct) then goes with
    /// the accelerations.
    pub(crate) corrected: bool,
    /// Whether the drift was taken out of the bodies' places.
    pub(crate) settled: bool,
}

/// The arrays of the sweeps, in the precision chosen.
#[derive(Clone, Debug)]
pub(crate) enum Arrays {
    F32(Sweeps<f32>),
    F64(Sweeps<f64>),
    Reference(Sweeps<DoubleDouble>),
}

impl Arrays {
    pub(crate) const fn precision(&self) -> Precision {
        match self {
            Self::F32(_) => Precision::F32,
            Self::F64(_) => Precision::F64,
            Self::Reference(_) => Precision::Reference,
        }
    }
}

/// Runs a generic expression on the arrays of whichever precision a workspace has.
macro_rules! in_precision {
    ($arrays:expr, $sweeps:ident => $body:expr) => {
        match $arrays {
            $crate::workspace::Arrays::F32($sweeps) => $body,
            $crate::workspace::Arrays::F64($sweeps) => $body,
            $crate::workspace::Arrays::Reference($sweeps) => $body,
        }
    };
}
pub(crate) use in_precision;

/// What the sweeps read and write, one entry a body unless it says otherwise. All vectors are in
/// world axes about the body's joint origin, in the model's units.
#[derive(Clone, Debug)]
pub(crate) struct Sweeps<T: Number> {
    pub(crate) links: Vec<Link<T>>,
    /// Where the bodies' own frames and centres of mass are in their joint frames.
    pub(crate) frames: Vec<BodyFrame<T::Scalar>>,
    /// -g, the acceleration of a world that replaces gravity.
    pub(crate) base: Motion<T>,
    /// Joint axes to world axes.
    pub(crate) rotation: Vec<Mat3<T>>,
    /// From the parent's origin to this one.
    pub(crate) offset: Vec<Vec3<T>>,
    /// Angular velocity.
    pub(crate) spin: Vec<Vec3<T>>,
    /// Relative velocity across the joint, S qd.
    pub(crate) joint_velocity: Vec<Motion<T>>,
    /// Velocity-product terms c of the acceleration.
    pub(crate) bias_acceleration: Vec<Motion<T>>,
    /// Motion subspaces S, one column a degree of freedom.
    pub(crate) subspace: Vec<Motion<T>>,
    /// Rigid inertia.
    pub(crate) inertia: Vec<RigidInertia<T>>,
    /// External force minus velocity-product force.
    pub(crate) external: Vec<Force<T>>,
    /// Origin in the world.
    pub(crate) position: Vec<Vec3<T>>,
    /// Velocity.
    pub(crate) velocity: Vec<Motion<T>>,
    /// Acceleration, gravity taken off.
    pub(crate) acceleration: Vec<Motion<T>>,
    /// Force that the joint transmits to the body.
    pub(crate) joint_wrench: Vec<Force<T>>,
    /// Articulated inertia IA, what the children hand on until the body's own turn comes; the
    /// composite inertia of CRBA.
    pub(crate) articulated: Vec<ArticulatedInertia<T>>,
    /// Bias force pA, likewise.
    pub(crate) bias: Vec<Force<T>>,
    /// Inertia [rotation, translation] of the body itself and of what arrives from its children
    /// before their joints let go: a pivot below rounding of it says nothing.
    pub(crate) carried: Vec<[T; 2]>,
    /// U = IA S, one column a degree of freedom.
    pub(crate) u_columns: Vec<Force<T>>,
    /// Of one-dof joints: X' U, U about the parent's origin, and u - U' c.
    pub(crate) above: Vec<(Force<T>, T)>,
    /// Joint forces given to ABA, one entry a degree of freedom.
    pub(crate) tau: Vec<T>,
    /// Inertia E that freedoms have of their own, one entry a degree of freedom.
    pub(crate) added: Vec<T>,
    /// What of it is off the diagonal ([`OwnInertia`]).
    pub(crate) across: Vec<T>,
    /// Whether any of it is not zero.
    pub(crate) adds: bool,
    /// u = tau - S' pA, then qdd; one entry a degree of freedom.
    pub(crate) u: Vec<T>,
    /// 1/D of one-dof joints.
    pub(crate) d_inverse: Vec<T>,
    /// Factors of D of joints with several freedoms; [`Sweeps::factor_of`] says which.
    pub(crate) factors: Vec<Option<SmallCholesky<T>>>,
    /// Index into `factors`.
    pub(crate) factor_of: Vec<u32>,
    /// Joint rates, one entry a degree of freedom.
    pub(crate) rates: Vec<T>,
    /// Memory of the corrections, taken when the first one is asked for.
    pub(crate) corrections: Option<Box<Corrections<T>>>,
    /// Memory of substitutions, likewise.
    pub(crate) substitution: Option<Box<Substitution<T>>>,
    /// Memory of derivatives, likewise.
    pub(crate) tangents: Option<Box<Tangents<T>>>,
}

impl<T: Number> Sweeps<T> {
    pub(crate) fn new(model: &Model) -> Self {
        let (n, dofs) = (model.bodies().len(), model.dof_count());
        let (links, frames) = Link::<T::Scalar>::of_model(model);
        let links: Vec<Link<T>> = (links.into_iter()).map(|link| link.map(T::splat)).collect();
        let mut factor_of = Vec::with_capacity(n);
        let mut factors = 0;
        for link in &links {
            factor_of.push(factors);
            factors += u32::from(link.kind.dof_count() > 1);
        }
        let gravity = model.gravity() / model.units().acceleration();
        Self {
            links,
            frames,
            base: Motion::new(Vec3::ZERO, -Vec3::from_glam(gravity)),
            rotation: vec![Mat3::IDENTITY; n],
            offset: vec![Vec3::ZERO; n],
            spin: vec![Vec3::ZERO; n],
            joint_velocity: vec![Motion::ZERO; n],
            bias_acceleration: vec![Motion::ZERO; n],
            subspace: vec![Motion::ZERO; dofs],
            inertia: vec![RigidInertia::ZERO; n],
            external: vec![Force::ZERO; n],
            position: vec![Vec3::ZERO; n],
            velocity: vec![Motion::ZERO; n],
            acceleration: vec![Motion::ZERO; n],
            joint_wrench: vec![Force::ZERO; n],
            articulated: vec![ArticulatedInertia::default(); n],
            bias: vec![Force::ZERO; n],
            carried: vec![[T::ZERO; 2]; n],
            u_columns: vec![Force::ZERO; dofs],
            above: vec![(Force::ZERO, T::ZERO); dofs],
            tau: vec![T::ZERO; dofs],
            added: vec![T::ZERO; dofs],
            across: vec![T::ZERO; dofs],
            adds: false,
            u: vec![T::ZERO; dofs],
            d_inverse: vec![T::ZERO; n],
            factors: vec![None; factors as usize],
            factor_of,
            rates: vec![T::ZERO; dofs],
            corrections: None,
            substitution: None,
            tangents: None,
        }
    }

    /// Takes the inertia of the freedoms' own for one lane; all lanes after one another.
    pub(crate) fn set_added(&mut self, lane: usize, forces: &Forces, scales: &Scales) {
        let given = &forces.joint_inertia;
        if lane == 0 {
            if self.adds {
                self.added.fill(T::ZERO);
                self.across.fill(T::ZERO);
            }
            self.adds = false;
        }
        self.adds |= !given.is_empty();
        for (dof, (own, &given)) in self.added.iter_mut().zip(given).enumerate() {
            own.set_lane(lane, T::Scalar::from_f64(given * scales.inertia(dof)));
        }
        let given = forces.inertias_across();
        for (dof, (own, &given)) in self.across.iter_mut().zip(given).enumerate() {
            own.set_lane(lane, T::Scalar::from_f64(given * scales.inertia(dof)));
        }
    }

    /// The inertia of a body's joint's own.
    #[inline]
    pub(crate) fn own(&self, body: usize) -> OwnInertia<'_, T> {
        let all = OwnInertia {
            diagonal: &self.added,
            across: &self.across,
        };
        all.of(self.dofs(body))
    }

    /// Degrees of freedom of a body's joint in arrays of that shape.
    pub(crate) fn dofs(&self, body: usize) -> core::ops::Range<usize> {
        let link = &self.links[body];
        link.v..link.v + link.kind.dof_count()
    }
}

impl Workspace {
    /// Takes the memory for one model and precision.
    #[must_use]
    pub fn new(model: &Model, precision: Precision) -> Self {
        let arrays = match precision {
            Precision::F32 => Arrays::F32(Sweeps::new(model)),
            Precision::F64 => Arrays::F64(Sweeps::new(model)),
            Precision::Reference => Arrays::Reference(Sweeps::new(model)),
        };
        Self {
            scales: Scales::of_model(model),
            arrays,
            computed: Computed::default(),
            time: 0.0,
            q: vec![0.0; model.position_count()],
            qd: vec![0.0; model.dof_count()],
            push: 0.0,
            qdd: vec![0.0; model.dof_count()],
            tau: vec![0.0; model.dof_count()],
            mass_matrix: Vec::new(),
            looped: first_loop(model),
            model: model.clone(),
        }
    }

    /// The same for a model of which only the tree is looked at: [`aba`](crate::aba) and what follows from it leave its
    /// loops open and its coupled joints free.
    #[must_use]
    pub fn of_tree(model: &Model, precision: Precision) -> Self {
        Self {
            looped: None,
            ..Self::new(model, precision)
        }
    }

    /// Refuses a model with loops, if it is not taken as a tree.
    pub(crate) fn refuse_loops(&self, by: &'static str) -> Result<(), Error> {
        let remedy = "use `Simulation` or `Solver`, which do, or leave the loops open knowingly (`Workspace::of_tree`)";
        refuse_looped(self.looped.as_ref(), by, remedy)
    }

    /// The precision it works in.
    #[must_use]
    pub fn precision(&self) -> Precision {
        self.arrays.precision()
    }

    /// Refuses a workspace made for another model.
    pub(crate) fn check_model(&self, model: &Model) -> Result<(), Error> {
        same_model(&self.model, model)
    }

    /// What errors of the joint accelerations are measured by at least.
    pub(crate) fn least_acceleration(&self) -> f64 {
        least_acceleration(&self.model, &self.scales, &self.qd, self.push)
    }

    pub(crate) fn require_state(&self) -> Result<(), Error> {
        require(self.computed.state, "kinematics", "forward_kinematics")
    }

    /// Names the body whose result overflowed, if one did.
    pub(crate) fn refuse_overflow(
        &self,
        quantity: &'static str,
        body: Option<usize>,
    ) -> Result<(), Error> {
        match body {
            None => Ok(()),
            Some(body) => Err(Error::Overflow {
                quantity,
                body: self.model.bodies()[body].name.clone(),
                time: self.time,
            }),
        }
    }

    pub(crate) fn check_body(&self, body: BodyId) -> Result<usize, Error> {
        if body.index() < self.model.bodies().len() {
            return Ok(body.index());
        }
        Err(Error::UnknownBody {
            model: self.model.name().to_owned(),
            body: body.index(),
        })
    }

    /// The joint accelerations of the last [`aba`](crate::aba) [rad/s^2 or m/s^2], shape
    /// [`Model::dof_count`].
    ///
    /// # Errors
    /// [`Error::NotComputed`].
    pub fn joint_accelerations(&self) -> Result<&[f64], Error> {
        require(self.computed.accelerations, "accelerations", "aba")?;
        Ok(&self.qdd)
    }

    /// Where a body's frame is in the world.
    ///
    /// # Errors
    /// [`Error::NotComputed`], [`Error::UnknownBody`], [`Error::Overflow`].
    pub fn pose(&self, body: BodyId) -> Result<Pose, Error> {
        require(self.computed.poses, "poses", "forward_kinematics")?;
        let i = self.check_body(body)?;
        let length = self.model.units().length;
        let pose = in_precision!(&self.arrays, s => {
            let rotation = (s.rotation[i] * s.frames[i].placement.rotation).to_glam();
            let origin = s.position[i] + s.frame_origin(i);
            Pose::new(
                DQuat::from_mat3(&rotation).normalize(),
                origin.to_glam() * length,
            )
        });
        self.refuse_overflow("pose", (!pose.translation.is_finite()).then_some(i))?;
        Ok(pose)
    }

    /// Velocity of a body: angular [rad/s], and linear of its frame's origin [m/s].
    ///
    /// # Errors
    /// [`Error::NotComputed`], [`Error::UnknownBody`], [`Error::Overflow`].
    pub fn velocity(&self, body: BodyId) -> Result<BodyMotion, Error> {
        require(self.computed.poses, "velocities", "forward_kinematics")?;
        let i = self.check_body(body)?;
        let units = self.model.units();
        let velocity = in_precision!(&self.arrays, s => {
            s.velocity[i].shifted(s.frame_origin(i)).map(Real::to_f64)
        });
        let velocity = BodyMotion {
            angular: velocity.angular.to_glam() / units.time,
            linear: velocity.linear.to_glam() * units.velocity(),
        };
        self.refuse_overflow("velocity", (!velocity.is_finite()).then_some(i))?;
        Ok(velocity)
    }

    /// Acceleration of a body in world axes: angular [rad/s^2], and linear of its frame's origin as
    /// an observer at rest sees it [m/s^2].
    ///
    /// # Errors
    /// [`Error::NotComputed`], [`Error::UnknownBody`], [`Error::Overflow`].
    pub fn acceleration(&self, body: BodyId) -> Result<BodyMotion, Error> {
        require(self.computed.accelerations, "accelerations", "aba")?;
        let i = self.check_body(body)?;
        let units = self.model.units();
        let acceleration = in_precision!(&self.arrays, s => {
            let (r, w) = (s.frame_origin(i), s.spin[i]);
            let seen = (s.acceleration[i] - s.base).shifted(r);
            Motion::new(seen.angular, seen.linear + w.cross(w.cross(r))).map(Real::to_f64)
        });
        let acceleration = BodyMotion {
            angular: acceleration.angular.to_glam() / (units.time * units.time),
            linear: acceleration.linear.to_glam() * units.acceleration(),
        };
        self.refuse_overflow("acceleration", (!acceleration.is_finite()).then_some(i))?;
        Ok(acceleration)
    }

    /// Force that a body's joint transmits to it, constraint and joint force together, in world
    /// axes about the joint's origin: moment [N m], force \[N\].
    ///
    /// # Errors
    /// [`Error::NotComputed`], [`Error::UnknownBody`], [`Error::Overflow`].
    pub fn joint_wrench(&self, body: BodyId) -> Result<BodyForce, Error> {
        require(
            self.computed.joint_wrenches,
            "joint wrenches",
            "joint_wrenches",
        )?;
        let i = self.check_body(body)?;
        let units = self.model.units();
        let force = in_precision!(&self.arrays, s => s.joint_wrench[i].map(Real::to_f64));
        let wrench = BodyForce::in_si(force, units);
        self.refuse_overflow("joint force", wrench.is_none().then_some(i))?;
        Ok(wrench.unwrap_or_default())
    }
}

impl<T: Real> Sweeps<T> {
    /// From the joint's origin to the origin of the body's own frame, world axes.
    fn frame_origin(&self, body: usize) -> Vec3<T> {
        self.rotation[body] * self.frames[body].placement.translation
    }
}

/// Refuses a workspace made for another model.
pub(crate) fn same_model(workspace: &Model, model: &Model) -> Result<(), Error> {
    if workspace.is_same(model) {
        return Ok(());
    }
    Err(Error::WrongWorkspace {
        workspace: workspace.name().to_owned(),
        model: model.name().to_owned(),
    })
}

pub(crate) fn require(
    computed: bool,
    what: &'static str,
    remedy: &'static str,
) -> Result<(), Error> {
    if computed {
        return Ok(());
    }
    Err(Error::NotComputed { what, remedy })
}
