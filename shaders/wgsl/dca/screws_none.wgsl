// What joints about z are where none is a screw.

fn turning_floor(slot: u32, floor: vec2<real>) -> real { return floor.x; }

fn seen_along(pitch: real, f: Force) -> Force { return f; }

fn put_along(pitch: real, f: Force) -> Force { return f; }

fn inertia_along(pitch: real, g: Inertia) -> Inertia { return g; }

fn rows_along(pitch: real, m: Matrix6) -> Matrix6 { return m; }

fn rate_along(pitch: real, m: Motion) -> real { return m.angular.z; }
