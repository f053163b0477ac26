//! The protocol: asked on standard input, answered on standard output, a line of JSON each.
//! docs/peers.md describes the lines.

use serde_json::json;
use std::hint::black_box;
use std::io::{self, BufRead, Write};
use std::time::Instant;

/// What may go wrong, as a line for people.
pub type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

/// Vertices and triangles of a file.
#[derive(Clone)]
pub struct Obj {
    pub vertices: Vec<[f64; 3]>,
    pub triangles: Vec<[u32; 3]>,
}

impl Obj {
    /// Reads `v x y z` and `f a b c` lines.
    pub fn read(path: &str) -> Result<Self> {
        let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
        let text = std::fs::read_to_string(path).map_err(|error| format!("{path}: {error}"))?;
        let vertex = |word: &str| word.parse::<u32>().ok()?.checked_sub(1);
        for line in text.lines() {
            let wrong = || format!("{path}: `{line}` is neither a vertex nor a triangle");
            let words: Vec<&str> = line.split(' ').collect();
            match words[..] {
                ["v", x, y, z] => vertices.push([x.parse()?, y.parse()?, z.parse()?]),
                ["f", a, b, c] => {
                    let [a, b, c] = [a, b, c].map(vertex);
                    let corners = a.zip(b).zip(c).map(|((a, b), c)| [a, b, c]);
                    triangles.push(corners.ok_or_else(wrong)?);
                }
                _ => return Err(wrong().into()),
            }
        }
        Ok(Self {
            vertices,
            triangles,
        })
    }
}

/// What is timed.
pub struct Method {
    pub name: &'static str,
    pub precision: &'static str,
    pub stage: &'static str,
    pub note: &'static str,
    pub call: Box<dyn FnMut() -> Result<Vec<[u32; 2]>>>,
}

/// Seconds of the calls that fit into `budget`, one at least, after one that fills the caches.
fn sample(method: &mut Method, budget: f64) -> Result<Vec<f64>> {
    black_box((method.call)()?);
    let mut samples = Vec::new();
    let start = Instant::now();
    while samples.is_empty() || start.elapsed().as_secs_f64() < budget {
        let before = Instant::now();
        black_box((method.call)()?);
        samples.push(before.elapsed().as_secs_f64());
    }
    Ok(samples)
}

/// Answers until the input ends.
pub fn serve(peer: &str, methods: &mut [Method]) -> Result<()> {
    let described: Vec<_> = methods
        .iter()
        .map(
            |m| json!({"name": m.name, "precision": m.precision, "stage": m.stage, "note": m.note}),
        )
        .collect();
    let answer = |value: serde_json::Value| {
        let mut output = io::stdout().lock();
        writeln!(output, "{value}")?;
        output.flush()
    };
    answer(json!({"peer": peer, "methods": described}))?;
    for line in io::stdin().lock().lines() {
        let line = line?;
        let (verb, rest) = line.split_once(' ').unwrap_or((&line, ""));
        let (index, budget) = rest.split_once(' ').unwrap_or((rest, ""));
        let method = index.parse().ok().and_then(|i: usize| methods.get_mut(i));
        let method = method.ok_or_else(|| format!("asked `{line}`, which names no method"))?;
        match verb {
            "time" => answer(json!(sample(method, budget.parse()?)?))?,
            "answer" => answer(json!({"pairs": (method.call)()?}))?,
            _ => return Err(format!("asked `{line}`").into()),
        }
    }
    Ok(())
}
