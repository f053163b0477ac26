//! A chunk: assembled from its outboard end inwards, solved from its two ends.

use super::interior::{Freedom, Interior, Joint, respond};
use super::join::{Joined, Node, Seam, join_across};
use super::place::{Placed, Places};
use super::plan::{ChunkPlan, Extent, Inboard, Outboard, Plan};
use super::rake::Rake;
use super::split::{Divide, Fault};
use crate::drive::along;
use crate::own::OwnInertia;
use vertebra_spatial::matrix6::add_scaled;
use vertebra_spatial::{ArticulatedInertia, Force, Mat6, Motion, Real, SmallCholesky};

/// A body, or half of one, that answers forces at its centre of mass and at another point with
/// accelerations: with its inertia M = LL' about the centre, that point at r, X the shift of motions
/// to it, bias force p and centripetal acceleration o of the point,
///
/// Phi11 = Z'Z, Phi12 = Z'V, Phi22 = V'V, b1 = o - Z'y, b2 = -V'y,   Z = L^-1 X', V = L^-1, y = L^-1 p.
///
/// The inboard end of an inner chunk is the same with B for X', which adds C to Phi22 and d to b2.
#[derive(Clone, Copy, Debug)]
pub(super) struct Inverse<T> {
    /// V.
    pub(super) own: Mat6<T>,
    /// Z.
    pub(super) far: Mat6<T>,
    /// y.
    pub(super) bias: [T; 6],
}

impl<T: Real> Inverse<T> {
    const NONE: Self = Self {
        own: Mat6::ZERO,
        far: Mat6::ZERO,
        bias: [T::ZERO; 6],
    };

    /// Factors M; `far` takes forces at the other point to forces at the centre. None if M is not
    /// positive definite to working precision.
    fn new(inertia: &ArticulatedInertia<T>, far: &Mat6<T>, bias: Force<T>) -> Option<Self> {
        let m = Mat6::from_inertia(inertia);
        let factor = SmallCholesky::factor(6, &m.0, &[T::ZERO; 6]).ok()?;
        let mut inverse = Self {
            own: Mat6::IDENTITY,
            far: *far,
            bias: bias.to_array(),
        };
        factor.solve_lower_rows(&mut inverse.own);
        factor.solve_lower_rows(&mut inverse.far);
        factor.solve_lower(&mut inverse.bias);
        Some(inverse)
    }

    /// The acceleration of the centre under a force there and one at the other point.
    fn respond(&self, own: &[T; 6], far: &[T; 6]) -> Motion<T> {
        let mut rest = self.own.mul(own);
        add_scaled(&mut rest, &self.far.mul(far), T::ONE);
        add_scaled(&mut rest, &self.bias, -T::ONE);
        Motion::from_array(self.own.transpose_mul(&rest))
    }
}

/// What a leaf keeps for the way down.
#[derive(Clone, Copy, Debug)]
pub(super) struct Leaf<T> {
    pub(super) body: Inverse<T>,
    pub(super) seam: Seam<T>,
    pub(super) joined: Joined<T>,
}

impl<T: Real> Leaf<T> {
    const NONE: Self = Self {
        body: Inverse::NONE,
        seam: Seam::RIGID,
        joined: Joined::NONE,
    };
}

/// What is computed chunk by chunk, in the order of the chunks.
#[derive(Clone, Debug)]
pub(super) struct Chunks<T> {
    /// Accelerations of the bodies' joints' origins.
    pub(super) accelerations: Vec<Motion<T>>,
    /// Joint accelerations.
    pub(super) qdd: Vec<T>,
    freedoms: Vec<Freedom<T>>,
    inner: Vec<Inverse<T>>,
    leaves: Vec<Leaf<T>>,
    /// What is joined to other chunks.
    pub(super) nodes: Vec<Node<T>>,
    /// What is raked onto a body.
    pub(super) rakes: Vec<Rake<T>>,
}

impl<T: Real> Chunks<T> {
    /// Memory for all chunks before `end`.
    pub(super) fn new(end: &Extent) -> Self {
        Self {
            accelerations: vec![Motion::ZERO; end.slot],
            qdd: vec![T::ZERO; end.dof],
            freedoms: vec![Freedom::NONE; end.dof],
            inner: vec![Inverse::NONE; end.inner],
            leaves: vec![Leaf::NONE; end.leaf],
            nodes: vec![Node::ZERO; end.node],
            rakes: vec![Rake::default(); end.rake],
        }
    }

    /// All of it, to be divided.
    pub(super) fn share(&mut self) -> Own<'_, T> {
        Own {
            accelerations: &mut self.accelerations,
            qdd: &mut self.qdd,
            freedoms: &mut self.freedoms,
            inner: &mut self.inner,
            leaves: &mut self.leaves,
            nodes: &mut self.nodes,
            rakes: &mut self.rakes,
        }
    }
}

/// A chunk's own share of [`Chunks`].
pub(super) struct Own<'a, T> {
    pub(super) accelerations: &'a mut [Motion<T>],
    qdd: &'a mut [T],
    pub(super) freedoms: &'a mut [Freedom<T>],
    pub(super) inner: &'a mut [Inverse<T>],
    pub(super) leaves: &'a mut [Leaf<T>],
    pub(super) nodes: &'a mut [Node<T>],
    pub(super) rakes: &'a mut [Rake<T>],
}

impl<T: Real> Divide for Own<'_, T> {
    fn divide(self, at: &Extent) -> (Self, Self) {
        let (accelerations, more_accelerations) = self.accelerations.split_at_mut(at.slot);
        let (qdd, more_qdd) = self.qdd.split_at_mut(at.dof);
        let (freedoms, more_freedoms) = self.freedoms.split_at_mut(at.dof);
        let (inner, more_inner) = self.inner.split_at_mut(at.inner);
        let (leaves, more_leaves) = self.leaves.split_at_mut(at.leaf);
        let (nodes, more_nodes) = self.nodes.split_at_mut(at.node);
        let (rakes, more_rakes) = self.rakes.split_at_mut(at.rake);
        let own = Self {
            accelerations,
            qdd,
            freedoms,
            inner,
            leaves,
            nodes,
            rakes,
        };
        let rest = Self {
            accelerations: more_accelerations,
            qdd: more_qdd,
            freedoms: more_freedoms,
            inner: more_inner,
            leaves: more_leaves,
            nodes: more_nodes,
            rakes: more_rakes,
        };
        (own, rest)
    }
}

/// What chunks read.
pub(super) struct Given<'a, T> {
    pub(super) plan: &'a Plan<T>,
    pub(super) places: &'a Places<T>,
    /// Joint forces in the model's order and the factors to its units; on the way up alone.
    pub(super) tau: &'a [f64],
    pub(super) force_scales: &'a [f64],
    /// Inertia of the freedoms' own in the order of the slots.
    pub(super) own: OwnInertia<'a, T>,
    /// Of a [correction](super::correct): what it changes of the accelerations before anything
    /// responds. Velocities then have no part in it.
    pub(super) jumps: Option<&'a [Motion<T>]>,
}

impl<'a, T: Real> Given<'a, T> {
    fn joint(&self, slot: usize) -> Joint<'a, T> {
        let (plan, places) = (self.plan, self.places);
        let link = &plan.links[slot];
        let dofs = plan.dofs_of(slot);
        let columns = &places.columns[dofs.clone()];
        let mut tau = [T::ZERO; 6];
        for (k, tau) in tau.iter_mut().enumerate().take(columns.len()) {
            *tau = T::from_f64(self.tau[link.v + k] / self.force_scales[link.v + k]);
        }
        Joint {
            kind: link.kind,
            columns,
            tau,
            own: self.own.of(dofs),
            pitch: link.pitch,
            c: places.bodies[slot].bias_acceleration,
        }
    }

    /// A body's share of its inertia and bias force about its handle point, rakes included.
    fn body(&self, slot: usize, share: f64, rakes: impl Iterator<Item = Rake<T>>) -> Rake<T> {
        let share = T::from_f64(share);
        let placed = &self.places.bodies[slot];
        let inertia = ArticulatedInertia::from(placed.inertia.map(|x| x * share));
        let mut sum = Rake {
            inertia,
            bias: placed.external * -share,
            carried: [inertia.angular.trace(), inertia.linear.trace()],
        };
        for rake in rakes {
            sum.add(&rake, share);
        }
        sum
    }
}

/// Assembles a chunk; `rakes` gives what is raked onto a slot's body, about its handle point.
pub(super) fn assemble<T: Real, R: Iterator<Item = Rake<T>>>(
    given: &Given<'_, T>,
    chunk: usize,
    own: Own<'_, T>,
    rakes: impl Fn(usize) -> R,
) -> Result<(), Fault> {
    let plan = given.plan;
    let ChunkPlan {
        inboard,
        outboard,
        last_share,
        ..
    } = plan.chunks[chunk];
    let slots = plan.slots_of(chunk);
    let (first, last) = (slots.start, slots.end - 1);
    let first_dof = plan.dofs[first] as usize;
    let places = &given.places.bodies;
    let inner = matches!(inboard, Inboard::Cut(_));

    let mut part = Interior::start(outboard != Outboard::Free);
    let mut end = slots.end;
    if outboard == Outboard::Leaf {
        end = last;
        if inner || last > first {
            part.shift(places[last].offset);
        }
    }
    for slot in (first..end).rev() {
        let placed = &places[slot];
        let share = if slot == last { last_share } else { 1.0 };
        let body = given.body(slot, share, rakes(slot));
        part.add(&body);
        if plan.at_center[slot] {
            part.move_handle(placed.arm, placed.centripetal(placed.arm));
        }
        let dofs = plan.dofs_of(slot);
        let freedoms = &mut own.freedoms[dofs.start - first_dof..dofs.end - first_dof];
        part.let_go(&given.joint(slot), freedoms)
            .ok_or(Fault::Singular(slot))?;
        if inner || slot > first {
            part.shift(placed.offset);
        }
    }

    let mut node = Node {
        phi11: Mat6::from_inertia(&part.inertia),
        phi12: part.tip,
        phi22: part.compliance,
        b1: part.bias.to_array(),
        b2: part.drift,
    };
    if let Inboard::Cut(cut) = inboard {
        let body = given.body(cut, 0.5, rakes(cut));
        part.add(&body);
        let inverse =
            Inverse::new(&part.inertia, &part.tip, part.bias).ok_or(Fault::Unjoined(cut))?;
        node.invert(&inverse);
        if let Some(kept) = own.inner.first_mut() {
            *kept = inverse;
        }
    }
    if let Some(leaf) = own.leaves.first_mut() {
        let placed = &places[last];
        let body = given.body(last, last_share, rakes(last));
        let to_joint = Mat6::IDENTITY.shifted_back(-placed.arm);
        leaf.body =
            Inverse::new(&body.inertia, &to_joint, body.bias).ok_or(Fault::Unjoined(last))?;
        let joint = given.joint(last);
        leaf.seam = Seam::new(&joint, &placed.rotation);
        let beyond = Node::leaf(&leaf.body, placed.centripetal(-placed.arm));
        (node, leaf.joined) = join_across(!inner, &node, &beyond, &leaf.seam, joint.c)
            .ok_or(Fault::Unjoined(last))?;
    }
    if let Some(kept) = own.rakes.first_mut() {
        let head = &places[first];
        *kept = Rake::of_node(&node, head, part.arriving(head.offset));
    }
    if let Some(kept) = own.nodes.first_mut() {
        *kept = node;
    }
    Ok(())
}

impl<T: Real> Node<T> {
    /// A body that is a leaf.
    fn leaf(body: &Inverse<T>, centripetal: Motion<T>) -> Self {
        let mut node = Self::ZERO;
        let Inverse { own, far, bias } = body;
        node.phi11.add_transpose_product(6, far, far, T::ONE);
        node.phi12.add_transpose_product(6, far, own, T::ONE);
        node.phi22.add_transpose_product(6, own, own, T::ONE);
        node.b1 = centripetal.to_array();
        add_scaled(&mut node.b1, &far.transpose_mul(bias), -T::ONE);
        add_scaled(&mut node.b2, &own.transpose_mul(bias), -T::ONE);
        node
    }

    /// From the head's form to that of two handles, the inboard body inverted.
    fn invert(&mut self, body: &Inverse<T>) {
        let Inverse { own, far, bias } = body;
        self.phi11 = Mat6::ZERO;
        self.phi12 = Mat6::ZERO;
        self.b1 = [T::ZERO; 6];
        self.phi11.add_transpose_product(6, own, own, T::ONE);
        self.phi12.add_transpose_product(6, own, far, T::ONE);
        self.phi22.add_transpose_product(6, far, far, T::ONE);
        add_scaled(&mut self.b1, &own.transpose_mul(bias), -T::ONE);
        add_scaled(&mut self.b2, &far.transpose_mul(bias), -T::ONE);
    }
}

/// What a chunk is given at its ends.
pub(super) struct Ends<T> {
    /// The force f1 on it or, at a path's head, the acceleration a1 that it hangs from.
    pub(super) x: [T; 6],
    /// The force f2 on it.
    pub(super) f2: [T; 6],
}

/// Solves a chunk for the accelerations of its bodies and joints.
pub(super) fn solve<T: Real>(
    given: &Given<'_, T>,
    chunk: usize,
    own: Own<'_, T>,
    ends: &Ends<T>,
) -> Result<(), Fault> {
    let plan = given.plan;
    let slots = plan.slots_of(chunk);
    let (first, last) = (slots.start, slots.end - 1);
    let first_dof = plan.dofs[first] as usize;
    // The force that a leaf's joint transmits to it acts on the rest the other way round.
    let leaf = own.leaves.first().map(|leaf| {
        let force = leaf.joined.force_across(&leaf.seam, &ends.x, &ends.f2);
        (leaf, force)
    });
    let tip = leaf.map_or(ends.f2, |(_, force)| force.map(|f| -f));
    let mut a = match own.inner.first() {
        Some(inverse) => inverse.respond(&ends.x, &tip),
        None => Motion::from_array(ends.x),
    };
    for slot in slots {
        let placed: &Placed<T> = &given.places.bodies[slot];
        if slot > first || plan.chunks[chunk].is_inner() {
            a = a.shifted(placed.offset);
        }
        if given.jumps.is_none() {
            a += placed.bias_acceleration;
        }
        let dofs = plan.dofs_of(slot);
        let columns = &given.places.columns[dofs.clone()];
        let inertia = given.own.of(dofs.clone());
        let dofs = dofs.start - first_dof..dofs.end - first_dof;
        let qdd = &mut own.qdd[dofs.clone()];
        match leaf {
            Some((leaf, force)) if slot == last => {
                // Of the accelerations on both sides of its joint the difference is S qdd; of a screw's
                // column alone the square is not 1.
                let pitch = plan.links[slot].pitch;
                let square = T::ONE + pitch * pitch;
                let center = leaf.body.respond(&ends.f2, &force);
                let mut across = center.shifted(-placed.arm);
                if given.jumps.is_none() {
                    across += placed.centripetal(-placed.arm);
                }
                for (qdd, column) in qdd.iter_mut().zip(columns) {
                    *qdd = (across - a).dot(along(*column)) / square;
                }
                a = across;
            }
            _ => {
                // A correction need not be exact.
                let solutions = if given.jumps.is_some() { 1 } else { 2 };
                let columns = (columns, inertia);
                respond(columns, &own.freedoms[dofs], &tip, solutions, &mut a, qdd);
            }
        }
        own.accelerations[slot - first] = match given.jumps {
            Some(jumps) => a + jumps[slot],
            None => a,
        };
    }
    let finite = own.accelerations.iter().position(|a| !a.is_finite());
    finite.map_or(Ok(()), |offset| Err(Fault::Overflow(first + offset)))
}
