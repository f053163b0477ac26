//! Elements as numbers for kernels, in the model's units; `shaders/wgsl/dca/loads.wgsl` reads them.

use super::Elements;
use super::ball::{Ball, Coordinate};
use super::freedom::Freedom;
use super::law::Part;
use crate::link::Scales;
use vertebra_assembly::{Model, Stop};
use vertebra_shaders::dca::{BALL_ROWS, ELEMENT_ROWS, WORKS};

/// Rows of a body.
pub(crate) type Rows = [[f64; 4]; ELEMENT_ROWS + BALL_ROWS];

/// Which parts of their laws kernels are on, as they have them: numbers of four by the places of freedoms. Nothing where none has
/// a bound.
#[derive(Debug, Default)]
pub(crate) struct Parts<'a> {
    /// Where each freedom of the model's stands among them.
    pub(crate) places: &'a [u32],
    pub(crate) single: Vec<f64>,
    pub(crate) balls: Vec<f64>,
}

/// A law's part in a word of them.
const fn part_at(word: u32, place: u32) -> Part {
    match word >> place & 3 {
        1 => Part::Least,
        2 => Part::Most,
        _ => Part::Slope,
    }
}

/// A word that is kept as a number.
#[expect(clippy::cast_possible_truncation, reason = "words of nine bits")]
const fn word_of(number: f64) -> u32 {
    number as u32
}

/// Stands for a bound where there is none, in any precision.
const BOUNDLESS: f64 = 1e37;

/// Kinds of stops.
const SOFT: f64 = 1.0;
const HARD: f64 = 2.0;

/// What of a spherical joint has ranges.
const CONE: f64 = 1.0;
const CONE_AND_TWIST: f64 = 2.0;
const WHOLE: f64 = 3.0;

/// Factors from SI to the model's units for a joint's coordinate, and for forces a displacement and a rate.
struct Factors {
    position: f64,
    force: f64,
    stiffness: f64,
    damping: f64,
    inertia: f64,
}

impl Factors {
    fn new(model: &Model, scales: &Scales, dof: usize) -> Self {
        let (rate, force) = (scales.rate[dof], 1.0 / scales.force[dof]);
        let position = rate / model.units().time;
        Self {
            position,
            force,
            stiffness: force / position,
            damping: force / rate,
            inertia: scales.inertia(dof),
        }
    }
}

impl Elements {
    /// Of each body: spring, rest, damper, rotor; friction, range, inertia that is moved; the stop. Of a spherical joint
    /// friction takes the place of the rest, which is a row of its own, and two more rows have cone and twist.
    pub(crate) fn rows(&self, scales: &Scales) -> Vec<Rows> {
        // Of spherical joints without elements rests have to be rotations.
        let mut none = Rows::default();
        none[1][3] = 1.0;
        let mut rows = vec![none; self.model.bodies().len()];
        for freedom in &self.freedoms {
            let factors = Factors::new(&self.model, scales, freedom.dof);
            rows[freedom.body as usize] = freedom.rows(&factors);
        }
        // Both in the order of the bodies.
        let mut balls = self.balls.iter().peekable();
        for (body, rows) in self.model.bodies().iter().zip(&mut rows) {
            let is_own = |ball: &&Ball| ball.dof == body.dof_start && body.dof_range().len() == 3;
            if let Some(ball) = balls.next_if(is_own) {
                *rows = ball.rows(&Factors::new(&self.model, scales, ball.dof));
            }
        }
        rows
    }

    /// Writes what motors are given: five numbers a freedom, by `places` of freedoms, one of the five after the
    /// other for all of them.
    pub(crate) fn put_motors(&self, scales: &Scales, places: &[u32], numbers: &mut [f64]) {
        let count = self.model.dof_count();
        numbers.fill(0.0);
        for &index in &self.active {
            let freedom = &self.freedoms[index as usize];
            let factors = Factors::new(&self.model, scales, freedom.dof);
            let place = places[freedom.dof] as usize;
            for (k, number) in freedom.motor_numbers(&factors).into_iter().enumerate() {
                numbers[k * count + place] = number;
            }
        }
        for ball in self.busy_balls() {
            let factors = Factors::new(&self.model, scales, ball.dof);
            for (k, of_kind) in ball.motor_numbers(&factors).into_iter().enumerate() {
                for (&place, number) in places[ball.dof..].iter().zip(of_kind) {
                    numbers[k * count + place as usize] = number;
                }
            }
        }
    }

    /// Whether a spherical joint has more than what acts in all directions alike without bounds.
    pub(crate) fn has_ball_laws(&self) -> bool {
        self.busy_balls()
            .any(|ball| ball.friction > 0.0 || !ball.bounds.is_empty() || !ball.motor.is_off())
    }

    /// Whether some law may be on a bound, so that a step may take several solutions.
    pub(crate) fn is_bounded(&self) -> bool {
        let of_freedoms = self.busy().any(|freedom| {
            let limited = freedom.motor.limit.min(freedom.effort) < f64::INFINITY;
            freedom.friction > 0.0 || freedom.ends.is_some() || (limited && !freedom.motor.is_off())
        });
        let of_balls = self.busy_balls().any(|ball| {
            let limited = ball.motor.limit.min(ball.effort) < f64::INFINITY;
            ball.friction > 0.0 || !ball.bounds.is_empty() || (limited && !ball.motor.is_off())
        });
        of_freedoms || of_balls
    }

    /// Takes the parts of laws that kernels are on.
    pub(super) fn take_parts(&mut self, parts: &Parts<'_>) {
        let (single, _) = parts.single.as_chunks::<4>();
        for &index in &self.active {
            let freedom = &mut self.freedoms[index as usize];
            let place = parts.places[freedom.dof] as usize;
            if let Some(&[_, _, word, _]) = single.get(place) {
                freedom.take_parts(word_of(word));
            }
        }
        let (of_balls, _) = parts.balls.as_chunks::<4>();
        for &index in &self.active_balls {
            let ball = &mut self.balls[index as usize];
            let place = parts.places[ball.dof] as usize;
            if let Some(&[stops, motor, friction]) =
                of_balls.get(place..).and_then(<[_]>::first_chunk)
            {
                ball.take_parts(word_of(stops[3]), [motor[0], friction[0]]);
            }
        }
    }

    /// Adds what sums of work by freedoms, one kind after the other in the model's units, have become more than
    /// they were, if they were any.
    pub(crate) fn add_works(&mut self, sums: &[f64], before: &[f64]) {
        let unit = self.model.units().energy();
        let count = sums.len() / WORKS;
        let sum =
            |sums: &[f64], kind: usize| sums.iter().skip(kind * count).take(count).sum::<f64>();
        let total = |kind: usize| (sum(sums, kind) - sum(before, kind)) * unit;
        self.work.motors += total(0);
        self.work.springs += total(1);
        self.work.dampers += total(2);
        self.work.friction += total(3);
        self.work.stops += total(4);
    }
}

/// What a stop does, if there is one, and which kind it is.
fn stop_row(stop: Option<Stop>, factors: &Factors) -> [f64; 4] {
    match stop {
        None => [0.0; 4],
        Some(Stop::Soft { stiffness, damping }) => [
            stiffness * factors.stiffness,
            damping * factors.damping,
            SOFT,
            0.0,
        ],
        Some(Stop::Hard { restitution }) => [restitution, 0.0, HARD, 0.0],
    }
}

impl Freedom {
    fn rows(&self, factors: &Factors) -> Rows {
        let [lower, upper] = self.ends.map_or([0.0; 2], |ends| ends.range);
        let bounded = |x: f64| (x * factors.position).clamp(-BOUNDLESS, BOUNDLESS);
        [
            [
                self.stiffness * factors.stiffness,
                self.rest * factors.position,
                self.damping * factors.damping,
                self.armature * factors.inertia,
            ],
            [
                self.friction * factors.force,
                bounded(lower),
                bounded(upper),
                self.ends.map_or(0.0, |ends| ends.moved) * factors.inertia,
            ],
            stop_row(self.ends.map(|ends| ends.stop), factors),
            [0.0; 4],
            [0.0; 4],
        ]
    }

    fn take_parts(&mut self, word: u32) {
        self.parts = [part_at(word, 0), part_at(word, 2)];
        self.stops.part = part_at(word, 4);
    }

    fn motor_numbers(&self, factors: &Factors) -> [f64; 5] {
        let motor = &self.motor;
        let limit = motor.limit.min(self.effort) * factors.force;
        [
            (motor.force + motor.damping * motor.rate) * factors.force,
            motor.position * factors.position,
            motor.stiffness * factors.stiffness,
            motor.damping * factors.damping,
            limit.min(BOUNDLESS),
        ]
    }
}

impl Ball {
    fn rows(&self, factors: &Factors) -> Rows {
        let bounded = |x: f64| x.clamp(-BOUNDLESS, BOUNDLESS);
        let mut rows = [
            [
                self.stiffness * factors.stiffness,
                self.friction * factors.force,
                self.damping * factors.damping,
                self.armature * factors.inertia,
            ],
            self.rest.to_glam().to_array(),
            stop_row(self.bounds.first().map(|bound| bound.ends.stop), factors),
            [0.0; 4],
            [0.0, 0.0, self.moved * factors.inertia, 0.0],
        ];
        for bound in &self.bounds {
            let [lower, upper] = bound.ends.range.map(bounded);
            let [_, _, _, cone, twist] = &mut rows;
            match bound.coordinate {
                Coordinate::Turn => (cone[3], twist[3]) = (upper, WHOLE),
                Coordinate::Swing(axis) => {
                    let [x, y, z] = axis.to_array();
                    *cone = [x, y, z, upper];
                    twist[3] = CONE;
                }
                Coordinate::Twist(_) => {
                    (twist[0], twist[1], twist[3]) = (lower, upper, CONE_AND_TWIST);
                }
            }
        }
        rows
    }

    fn take_parts(&mut self, word: u32, [motor, friction]: [f64; 2]) {
        self.drives.share = motor;
        self.rubs.share = friction;
        for (bound, place) in self.bounds.iter_mut().zip([0, 4]) {
            bound.taken.part = part_at(word, place);
        }
    }

    fn motor_numbers(&self, factors: &Factors) -> [[f64; 3]; 5] {
        let motor = &self.motor;
        let push = (motor.torque + motor.rate * motor.damping) * factors.force;
        let [x, y, z, w] = motor.orientation.normalize().to_array();
        let limit = motor.limit.min(self.effort) * factors.force;
        [
            push.to_array(),
            [x, y, z],
            [w, motor.stiffness * factors.stiffness, 0.0],
            [motor.damping * factors.damping, 0.0, 0.0],
            [limit.min(BOUNDLESS), 0.0, 0.0],
        ]
    }
}
