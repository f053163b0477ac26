//! Whoever takes part in a comparison.

use serde::Deserialize;
use std::hint::black_box;
use std::time::{Duration, Instant};

/// A method, as its program describes it.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Method {
    /// Name in the rows.
    pub name: String,
    /// Floating-point type of the computation, `"-"` where neither describes it.
    pub precision: String,
    /// Methods of one stage answer the same question from the same starting point.
    pub stage: String,
    /// What exactly is timed.
    pub note: String,
}

/// What a method found.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Answer {
    /// Colliding pairs of triangles, in any order.
    Pairs(Vec<[u32; 2]>),
    /// Joint accelerations in every state [rad/s^2 or m/s^2].
    Accelerations(Vec<Vec<f64>>),
}

/// One program and its methods.
pub trait Contender {
    /// Name and version.
    fn name(&self) -> &str;

    /// What it can be asked to do.
    fn methods(&self) -> &[Method];

    /// Calls a method for about so many seconds \[s\]; the time of each call \[s\], after one that
    /// is not counted.
    ///
    /// # Errors
    /// If the method fails, or its program does not answer.
    fn time(&mut self, method: usize, seconds: f64) -> anyhow::Result<Vec<f64>>;

    /// What a method finds.
    ///
    /// # Errors
    /// If the method fails, or its program does not answer.
    fn answer(&mut self, method: usize) -> anyhow::Result<Answer>;
}

/// One of our methods.
pub struct OwnMethod<'a> {
    /// Its description.
    pub method: Method,
    /// Problems that `call` solves: its time is divided by them.
    pub problems: usize,
    /// What is timed.
    pub call: Box<dyn FnMut() -> anyhow::Result<()> + 'a>,
    /// What it finds.
    pub answer: Box<dyn FnMut() -> anyhow::Result<Answer> + 'a>,
}

/// Our methods, in this process.
pub struct Own<'a> {
    described: Vec<Method>,
    methods: Vec<OwnMethod<'a>>,
}

impl<'a> Own<'a> {
    /// Takes part with these methods.
    #[must_use]
    pub fn new(methods: Vec<OwnMethod<'a>>) -> Self {
        Self {
            described: methods.iter().map(|m| m.method.clone()).collect(),
            methods,
        }
    }
}

impl Contender for Own<'_> {
    fn name(&self) -> &str {
        concat!("vertebra ", env!("CARGO_PKG_VERSION"))
    }

    fn methods(&self) -> &[Method] {
        &self.described
    }

    fn time(&mut self, method: usize, seconds: f64) -> anyhow::Result<Vec<f64>> {
        let OwnMethod { problems, call, .. } = &mut self.methods[method];
        call()?;
        let mut samples = Vec::new();
        let budget = Duration::from_secs_f64(seconds);
        let start = Instant::now();
        while samples.is_empty() || start.elapsed() < budget {
            let before = Instant::now();
            black_box(call()?);
            samples.push(before.elapsed().as_secs_f64() / *problems as f64);
        }
        Ok(samples)
    }

    fn answer(&mut self, method: usize) -> anyhow::Result<Answer> {
        (self.methods[method].answer)()
    }
}
