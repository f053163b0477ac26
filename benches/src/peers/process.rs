//! A contender in a process of its own, asked on its standard input, answering on its standard
//! output.
//!
//! It is started with the folder of the input as its last argument and describes itself in a line of
//! JSON: `{"peer": name and version, "methods": [{"name", "precision", "stage", "note"}, ..]}`. Then
//! it answers every line with one line: `time <method> <seconds>` with `[seconds of a call, ..]`,
//! `answer <method>` with `{"pairs": [[a, b], ..]}` or `{"accelerations": [[..], ..]}`. It ends with
//! its input. One that does not answer within [`PATIENCE`] is ended.

use super::contender::{Answer, Contender, Method};
use anyhow::{Context, bail};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::time::Duration;

/// How long an answer may take: the longest there are, of programs that build something large on a busy machine, take
/// seconds.
pub const PATIENCE: Duration = Duration::from_secs(120);

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
    output: Receiver<std::io::Result<String>>,
    patience: Duration,
    hello: Hello,
}

impl Process {
    /// Starts a program on an input, for one thread.
    ///
    /// # Errors
    /// If it cannot be started or does not describe itself.
    pub fn start(command: &[String], folder: &Path) -> anyhow::Result<Self> {
        Self::start_with(PATIENCE, command, folder)
    }

    fn start_with(patience: Duration, command: &[String], folder: &Path) -> anyhow::Result<Self> {
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
            output: lines(output),
            patience,
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
        let line = match self.output.recv_timeout(self.patience) {
            Ok(line) => line?,
            Err(RecvTimeoutError::Disconnected) => {
                bail!("it ended early; what it said is further up")
            }
            Err(RecvTimeoutError::Timeout) => {
                // An answer that comes late must not pass for that to the next question.
                self.end();
                bail!(
                    "it did not answer within {:?}, and was ended",
                    self.patience
                )
            }
        };
        let shown: String = line.chars().take(80).collect();
        serde_json::from_str(&line).with_context(|| format!("it answered `{}`", shown.trim_end()))
    }

    /// Ends the program and waits for it, so that its memory is free for the next.
    fn end(&mut self) {
        drop(self.input.take());
        // It may have ended long ago.
        drop(self.child.kill());
        drop(self.child.wait());
    }
}

/// What a program says, line by line, read by a thread that ends with it: reading has no time limit of its own.
fn lines(output: ChildStdout) -> Receiver<std::io::Result<String>> {
    let (sender, receiver) = sync_channel(1);
    std::thread::spawn(move || {
        for line in BufReader::new(output).lines() {
            if sender.send(line).is_err() {
                break;
            }
        }
    });
    receiver
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
    fn drop(&mut self) {
        self.end();
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    /// A program of a few lines that speaks the protocol, or does not.
    fn shell_with(patience: Duration, script: &str) -> anyhow::Result<Process> {
        let command = ["sh", "-c", script, "peer"].map(str::to_owned);
        Process::start_with(patience, &command, Path::new("folder"))
    }

    fn shell(script: &str) -> anyhow::Result<Process> {
        shell_with(PATIENCE, script)
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

    #[test]
    fn a_program_that_says_nothing_is_ended() {
        let patience = Duration::from_millis(300);
        // With exec there is one process to be ended, and no other that keeps the output open.
        assert!(shell_with(patience, "exec sleep 60").is_err());
        let late = format!("{HELLO}; read a; exec sleep 60");
        let mut late = shell_with(patience, &late).unwrap();
        let error = late.answer(0).err().unwrap();
        assert!(error.to_string().contains("within 300ms"), "{error}");
        let error = late.answer(0).err().unwrap();
        assert!(error.to_string().contains("has ended"), "{error}");
    }
}
