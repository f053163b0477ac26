//! Methods of several programs taking turns.

use super::contender::{Answer, Contender, Method};
use crate::interrupt::Interrupt;

/// How long to measure a problem.
#[derive(Clone, Copy, Debug)]
pub struct Plan {
    /// Times each method has a turn.
    pub rounds: usize,
    /// Length of a turn \[s\].
    pub turn: f64,
}

impl Plan {
    /// The plan for numbers to publish, or to see that everything runs.
    #[must_use]
    pub fn new(quick: bool) -> Self {
        if quick {
            Self {
                rounds: 2,
                turn: 0.02,
            }
        } else {
            Self {
                rounds: 9,
                turn: 0.1,
            }
        }
    }
}

/// What came of one method.
#[derive(Debug)]
pub struct Measured {
    /// Index of its program.
    pub contender: usize,
    /// The method.
    pub method: Method,
    /// Time of every call \[s\], of all rounds.
    pub samples: Vec<f64>,
    /// What it found.
    pub answer: Answer,
}

/// Gives every method a turn in every round, each round beginning with another one. A program that
/// fails is out, with its error; an interrupt ends the rounds.
pub fn measure(
    contenders: &mut [Box<dyn Contender + '_>],
    plan: &Plan,
    interrupt: &Interrupt,
) -> (Vec<Measured>, Vec<(usize, anyhow::Error)>) {
    let mut failed: Vec<(usize, anyhow::Error)> = Vec::new();
    let mut entries: Vec<(usize, Measured)> = Vec::new();
    for (contender, program) in contenders.iter_mut().enumerate() {
        for (index, method) in program.methods().to_vec().into_iter().enumerate() {
            match program.answer(index) {
                Ok(answer) => entries.push((
                    index,
                    Measured {
                        contender,
                        method,
                        samples: Vec::new(),
                        answer,
                    },
                )),
                Err(error) => {
                    failed.push((contender, error));
                    break;
                }
            }
        }
    }
    for round in 0..plan.rounds {
        for turn in 0..entries.len() {
            if interrupt.requested() {
                break;
            }
            let place = (round + turn) % entries.len();
            let (index, entry) = &mut entries[place];
            if failed.iter().any(|(out, _)| *out == entry.contender) {
                continue;
            }
            match contenders[entry.contender].time(*index, plan.turn) {
                Ok(samples) => entry.samples.extend(samples),
                Err(error) => failed.push((entry.contender, error)),
            }
        }
    }
    let whole = entries.into_iter().map(|(_, entry)| entry);
    let whole = whole.filter(|entry| !failed.iter().any(|(out, _)| *out == entry.contender));
    (whole.collect(), failed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::RefCell;
    use std::rc::Rc;

    type Log = Rc<RefCell<Vec<&'static str>>>;

    /// Logs its turns and fails in one of them.
    struct Program {
        name: &'static str,
        methods: Vec<Method>,
        fails_in_turn: usize,
        log: Log,
    }

    impl Contender for Program {
        fn name(&self) -> &str {
            self.name
        }

        fn methods(&self) -> &[Method] {
            &self.methods
        }

        fn time(&mut self, _method: usize, seconds: f64) -> anyhow::Result<Vec<f64>> {
            self.log.borrow_mut().push(self.name);
            let turns = self
                .log
                .borrow()
                .iter()
                .filter(|n| **n == self.name)
                .count();
            anyhow::ensure!(turns != self.fails_in_turn, "broken");
            Ok(vec![seconds, seconds])
        }

        fn answer(&mut self, _method: usize) -> anyhow::Result<Answer> {
            Ok(Answer::Pairs(Vec::new()))
        }
    }

    fn program(name: &'static str, fails_in_turn: usize, log: &Log) -> Box<dyn Contender> {
        let method = Method {
            name: name.to_owned(),
            precision: "-".to_owned(),
            stage: "total".to_owned(),
            note: String::new(),
        };
        Box::new(Program {
            name,
            methods: vec![method],
            fails_in_turn,
            log: log.clone(),
        })
    }

    const PLAN: Plan = Plan {
        rounds: 3,
        turn: 0.5,
    };

    #[test]
    fn methods_take_turns_and_every_round_begins_with_another() {
        let log = Log::default();
        let mut contenders = [program("a", 0, &log), program("b", 0, &log)];
        let (measured, failed) = measure(&mut contenders, &PLAN, &Interrupt::default());
        assert!(failed.is_empty());
        assert_eq!(*log.borrow(), ["a", "b", "b", "a", "a", "b"]);
        assert!(measured.iter().all(|m| m.samples == [0.5; 6]));
    }

    #[test]
    fn a_program_that_fails_is_out_and_costs_no_other() {
        let log = Log::default();
        let mut contenders = [program("a", 2, &log), program("b", 0, &log)];
        let (measured, failed) = measure(&mut contenders, &PLAN, &Interrupt::default());
        assert_eq!(*log.borrow(), ["a", "b", "b", "a", "b"]);
        assert_eq!((measured.len(), measured[0].contender), (1, 1));
        assert_eq!((failed.len(), failed[0].0), (1, 0));
    }
}
