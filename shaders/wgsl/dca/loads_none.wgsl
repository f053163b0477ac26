// For models in whose joints nothing acts but the forces given.

const HAS_OWN = false;

struct One {
    force: real,
    parts: real,
    own: real,
}

fn load_one(slot: u32, q: u32, v: u32, tau: real) -> One { return One(tau, 0.0, 0.0); }

// Along a joint's axes.
struct Load {
    force: Force,
    own: Force,
}

alias Moments = vec3<real>;

struct Turning {
    force: vec3<real>,
    own: Moments,
}

fn load_turning(slot: u32, q: u32, v: u32) -> Turning {
    return Turning(joint_forces3(v), zero3());
}

fn load_all(v: u32) -> Load {
    return Load(Force(joint_forces3(v), joint_forces3(v + 3u)), force_zero());
}

fn is_turning_held(own: Moments) -> bool { return false; }

fn with_moments(s: Sym3, own: Moments, axes: mat3x3<real>) -> Sym3 { return s; }

fn moments_kept(v: u32) -> Moments { return zero3(); }

fn keep_moments(v: u32, own: Moments) {}

fn joint_basis(kind: u32, v: u32, axes: mat3x3<real>) -> mat3x3<real> { return axes; }

fn is_held(own: Force) -> bool { return false; }

fn with_own(d: real, own: real) -> real { return d; }

fn with_own3(s: Sym3, own: vec3<real>, axes: mat3x3<real>) -> Sym3 { return s; }

fn less_own(wanted: real, own: real, qdd: real) -> real { return wanted; }

fn own_kept3(v: u32) -> vec3<real> { return zero3(); }

fn keep_own3(v: u32, own: vec3<real>) {}

struct Drive {
    force: Force,
}

fn drive_of(slot: u32, kind: u32) -> Drive {
    let v = dof_of(slot);
    switch kind {
        case REVOLUTE, SCREW: {
            return Drive(Force(vec3<real>(0.0, 0.0, joint_force(v)), zero3()));
        }
        case PRISMATIC: { return Drive(Force(zero3(), vec3<real>(0.0, 0.0, joint_force(v)))); }
        case SPHERICAL: { return Drive(Force(joint_forces3(v), zero3())); }
        case FREE: { return Drive(Force(joint_forces3(v), joint_forces3(v + 3u))); }
        default: { return Drive(force_zero()); }
    }
}

// What a joint that accelerates so is to transmit along its one freedom, or along its freedoms in joint axes.
fn driven_one(spot: Spot, tau: real, qdd: real) -> real { return tau; }

fn driven(spot: Spot, qdd: Motion) -> Force { return drive_of(spot.slot, kind_of(spot.flags)).force; }

fn compliant(g: Inertia, drive: Drive) -> Inertia { return g; }

fn with_held(rows: Force, drive: Drive) -> Force { return rows; }

fn holding(drive: Drive) -> Force { return force_zero(); }
