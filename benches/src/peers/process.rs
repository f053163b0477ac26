//! A contender in a process of its own, asked on its standard input, answering on its standard
//! output.
//!
//! It is started with the folder of the input as its last argument and describes itself in a line of
//! JSON: `{"peer": name and version, "methods": [{"name", "precision", "stage", "note"}, ..]}`. Then
//! it answers every line with one line: `time <method> <seconds>` with `[seconds of a call, ..]`,
//! `answer <method>` with `{"pairs": [[a, b], ..]}` or `{"accelerations": [[..], ..]}`. It ends with
//! its input.

use super::contender::{Answer, Contender, Method};
use anyhow::{Context, ensure};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

/// What a program says first.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Hello {
    peer: String,
    methods: Vec<Method>,
}

/// A running program.
pub struct Process {
    child: Child,
    /// None once the program is told to end.
    input: Option<ChildStdin>,
    output: BufReader<ChildStdout>,
    hello: Hello,
}

impl Process {
    /// Starts a program on an input, for one thread.
    ///
    /// # Errors
    /// If it cannot be started or does not describe itself.
    pub fn start(command: &[String], folder: &Path) -> anyhow::Result<Self> {
        let (program, arguments) = command.split_first().context("no command is given")?;
        let mut child = Command::new(program)
            .args(arguments)
            .arg(folder)
            // Libraries that take their number of threads from the environment.
            .envs([("OMP_NUM_THREADS", "1"), ("IGL_NUM_THREADS", "1")])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .with_context(|| format!("cannot run {program}"))?;
        let input = child.stdin.take();
        let output = child.stdout.take().context("it has no output")?;
        let mut process = Self {
            child,
            input,
            output: BufReader::new(output),
            hello: Hello {
                peer: program.clone(),
                methods: Vec::new(),
            },
        };
        process.hello = process.read()?;
        Ok(process)
    }

    fn ask<T: DeserializeOwned>(&mut self, question: &str) -> anyhow::Result<T> {
        let input = self.input.as_mut().context("it has ended")?;
        writeln!(input, "{question}").context("it ended early")?;
        input.flush().context("it ended early")?;
        self.read()
    }

    fn read<T: DeserializeOwned>(&mut self) -> anyhow::Result<T> {
        let mut line = String::new();
        self.output.read_line(&mut line)?;
        ensure!(
            !line.is_empty(),
            "it ended early; what it said is further up"
        );
        let shown: String = line.chars().take(80).collect();
        serde_json::from_str(&line).with_context(|| format!("it answered `{}`", shown.trim_end()))
    }
}

impl Contender for Process {
    fn name(&self) -> &str {
        &self.hello.peer
    }

    fn methods(&self) -> &[Method] {
        &self.hello.methods
    }

    fn time(&mut self, method: usize, seconds: f64) -> anyhow::Result<Vec<f64>> {
        self.ask(&format!("time {method} {seconds}"))
    }

    fn answer(&mut self, method: usize) -> anyhow::Result<Answer> {
        self.ask(&format!("answer {method}"))
    }
}

impl Drop for Process {
    /// Ends the program and waits for it, so that its memory is free for the next.
    fn drop(&mut self) {
        drop(self.input.take());
        // It may have ended long ago.
        drop(self.child.kill());
        drop(self.child.wait());
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    /// A program of a few lines that speaks the protocol, or does not.
    fn shell(script: &str) -> anyhow::Result<Process> {
        let command = ["sh", "-c", script, "peer"].map(str::to_owned);
        Process::start(&command, Path::new("folder"))
    }

    const HELLO: &str = r#"echo '{"peer":"p 1","methods":[{"name":"m","precision":"f64","stage":"total","note":""}]}'"#;

    #[test]
    fn a_program_describes_itself_and_answers() {
        let script = format!(
            "{HELLO}; read verb method; test \"$verb $method $1\" = 'answer 0 folder' && echo '{{\"pairs\":[[1,2]]}}'; \
             read rest; test \"$rest\" = 'time 0 0.5' && echo '[0.25,1e-3]'; read end"
        );
        let mut process = shell(&script).unwrap();
        assert_eq!(process.name(), "p 1");
        assert_eq!(process.methods()[0].stage, "total");
        assert!(matches!(process.answer(0).unwrap(), Answer::Pairs(p) if p == [[1, 2]]));
        assert_eq!(process.time(0, 0.5).unwrap(), [0.25, 1e-3]);
    }

    #[test]
    fn a_program_that_fails_is_an_error_and_not_a_hang() {
        assert!(Process::start(&[], Path::new("folder")).is_err());
        assert!(shell("exit 1").is_err());
        let error = shell("echo hello; read end").err().unwrap();
        assert!(format!("{error:#}").contains("`hello`"), "{error:#}");
        let mut ended = shell(HELLO).unwrap();
        assert!(ended.answer(0).is_err());
        assert!(ended.time(0, 0.1).is_err());
    }
}
