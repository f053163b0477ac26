//! The protocol: asked on standard input, answered on standard output, a line of JSON each.
//! docs/peers.md describes the lines.

use serde_json::json;
use std::hint::black_box;
use std::io::{self, BufRead, Write};
use std::time::Instant;

/// Vertices and triangles of a file.
#[derive(Clone)]
pub struct Obj {
    pub vertices: Vec<[f64; 3]>,
    pub triangles: Vec<[u32; 3]>,
}

impl Obj {
    /// Reads `v x y z` and `f a b c` lines.
    pub fn read(path: &str) -> Result<Self, Box<dyn std::error::Error>> {
        let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
        for line in std::fs::read_to_string(path)?.lines() {
            let words: Vec<&str> = line.split(' ').collect();
            match words[..] {
                ["v", x, y, z] => vertices.push([x.parse()?, y.parse()?, z.parse()?]),
                ["f", a, b, c] => {
                    let [a, b, c]: [u32; 3] = [a.parse()?, b.parse()?, c.parse()?];
                    triangles.push([a - 1, b - 1, c - 1]);
                }
                _ => return Err(format!("{path}: {line}").into()),
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
    pub call: Box<dyn FnMut() -> Vec<[u32; 2]>>,
}

/// Seconds of the calls that fit into `budget`, one at least, after one that fills the caches.
fn sample(method: &mut Method, budget: f64) -> Vec<f64> {
    black_box((method.call)());
    let mut samples = Vec::new();
    let start = Instant::now();
    while samples.is_empty() || start.elapsed().as_secs_f64() < budget {
        let before = Instant::now();
        black_box((method.call)());
        samples.push(before.elapsed().as_secs_f64());
    }
    samples
}

/// Answers until the input ends.
pub fn serve(peer: &str, methods: &mut [Method]) {
    let described: Vec<_> = methods
        .iter()
        .map(
            |m| json!({"name": m.name, "precision": m.precision, "stage": m.stage, "note": m.note}),
        )
        .collect();
    let answer = |value: serde_json::Value| {
        println!("{value}");
        io::stdout().flush().expect("a reader");
    };
    answer(json!({"peer": peer, "methods": described}));
    for line in io::stdin().lock().lines() {
        let line = line.expect("text");
        let words: Vec<&str> = line.split(' ').collect();
        match words[..] {
            ["time", index, budget] => {
                let method = &mut methods[index.parse::<usize>().expect("an index")];
                answer(json!(sample(method, budget.parse().expect("seconds"))));
            }
            ["answer", index] => {
                let method = &mut methods[index.parse::<usize>().expect("an index")];
                answer(json!({"pairs": (method.call)()}));
            }
            _ => panic!("asked `{line}`"),
        }
    }
}
