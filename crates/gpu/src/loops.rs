//! Which shaders are sure to end.
//!
//! A loop without end is undefined behaviour to a driver's compiler, which may draw any conclusion
//! from it. wgpu therefore counts the rounds of every loop and leaves it after 2^64; the counter
//! keeps compilers from unrolling, which doubled the time of a radix sort. A shader all of whose
//! loops are seen to end does without.
//!
//! A loop is seen to end when it counts up, `for (var i = start; i < bound; i += step)`, where the
//! body does not write the u32 `i`, `step` is a constant above zero, and `i + step` cannot wrap:
//! `i < bound` leaves room for a step of one whatever the bound, and for a larger one if the bound
//! is a constant of at most 2^32 - step. So `i` grows from round to round, which u32 allows finitely
//! often. WGSL has no recursion: nothing else can run forever.

use naga::{
    BinaryOperator, Block, Expression, Function, Handle, Literal, LocalVariable, Module, Range,
    Statement,
};

/// Whether every loop of a shader is seen to end.
pub(crate) fn all_end(module: &Module) -> bool {
    let entry_points = module.entry_points.iter().map(|entry| &entry.function);
    let mut functions = module.functions.iter().map(|(_, function)| function);
    let ends = |function: &Function| Loops { module, function }.all_end(&function.body);
    functions.all(ends) && entry_points.into_iter().all(ends)
}

struct Loops<'a> {
    module: &'a Module,
    function: &'a Function,
}

impl Loops<'_> {
    fn all_end(&self, block: &Block) -> bool {
        block.iter().all(|statement| match statement {
            Statement::Block(block) => self.all_end(block),
            Statement::If { accept, reject, .. } => self.all_end(accept) && self.all_end(reject),
            Statement::Switch { cases, .. } => cases.iter().all(|case| self.all_end(&case.body)),
            Statement::Loop {
                body, continuing, ..
            } => self.ends(body, continuing) && self.all_end(body),
            _ => true,
        })
    }

    fn ends(&self, body: &Block, continuing: &Block) -> bool {
        let Some((counter, bound)) = self.condition(body) else {
            return false;
        };
        let Some(step @ 1..) = self.step(continuing, counter) else {
            return false;
        };
        let bound = self.constant(bound);
        let has_room = step == 1 || bound.is_some_and(|b| b.checked_add(step - 1).is_some());
        has_room && !self.writes(body, counter)
    }

    /// Counter and bound of a loop that begins with leaving unless `counter < bound`.
    fn condition(&self, body: &Block) -> Option<(Handle<LocalVariable>, Handle<Expression>)> {
        let mut evaluated = Vec::new();
        for statement in body {
            match statement {
                Statement::Emit(range) => evaluated.push(range.clone()),
                Statement::If {
                    condition, reject, ..
                } if matches!(reject[..], [Statement::Break]) => {
                    let Expression::Binary {
                        op: BinaryOperator::Less,
                        left,
                        right,
                    } = self.function.expressions[*condition]
                    else {
                        return None;
                    };
                    // In each round, not once before the loop.
                    let current = contains(&evaluated, *condition) && contains(&evaluated, left);
                    return current.then_some((self.loaded(left)?, right));
                }
                _ => return None,
            }
        }
        None
    }

    /// What the end of a round adds to the counter, if it does nothing else.
    fn step(&self, continuing: &Block, counter: Handle<LocalVariable>) -> Option<u32> {
        let mut evaluated = Vec::new();
        let mut step = None;
        for statement in continuing {
            match statement {
                Statement::Emit(range) => evaluated.push(range.clone()),
                Statement::Store { pointer, value }
                    if step.is_none() && self.local(*pointer) == Some(counter) =>
                {
                    let Expression::Binary {
                        op: BinaryOperator::Add,
                        left,
                        right,
                    } = self.function.expressions[*value]
                    else {
                        return None;
                    };
                    let adds = contains(&evaluated, left) && self.loaded(left) == Some(counter);
                    step = Some(self.constant(right).filter(|_| adds)?);
                }
                _ => return None,
            }
        }
        step
    }

    /// Whether a variable may change: by a store, or by a function that is given its address. A
    /// pointer to a scalar can go nowhere else.
    fn writes(&self, block: &Block, variable: Handle<LocalVariable>) -> bool {
        block.iter().any(|statement| match statement {
            Statement::Store { pointer, .. } => self.local(*pointer) == Some(variable),
            Statement::Call { arguments, .. } => arguments
                .iter()
                .any(|argument| self.local(*argument) == Some(variable)),
            Statement::Block(block) => self.writes(block, variable),
            Statement::If { accept, reject, .. } => {
                self.writes(accept, variable) || self.writes(reject, variable)
            }
            Statement::Switch { cases, .. } => {
                cases.iter().any(|case| self.writes(&case.body, variable))
            }
            Statement::Loop {
                body, continuing, ..
            } => self.writes(body, variable) || self.writes(continuing, variable),
            _ => false,
        })
    }

    /// The variable that an expression points to.
    fn local(&self, pointer: Handle<Expression>) -> Option<Handle<LocalVariable>> {
        match self.function.expressions[pointer] {
            Expression::LocalVariable(variable) => Some(variable),
            _ => None,
        }
    }

    /// The variable whose value an expression is.
    fn loaded(&self, value: Handle<Expression>) -> Option<Handle<LocalVariable>> {
        match self.function.expressions[value] {
            Expression::Load { pointer } => self.local(pointer),
            _ => None,
        }
    }

    fn constant(&self, value: Handle<Expression>) -> Option<u32> {
        let literal = match self.function.expressions[value] {
            Expression::Constant(constant) => {
                &self.module.global_expressions[self.module.constants[constant].init]
            }
            ref expression => expression,
        };
        match literal {
            Expression::Literal(Literal::U32(word)) => Some(*word),
            _ => None,
        }
    }
}

fn contains(ranges: &[Range<Expression>], expression: Handle<Expression>) -> bool {
    let mut all = ranges.iter().flat_map(|range| range.clone());
    all.any(|evaluated| evaluated == expression)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A shader with this in its body.
    fn shader(body: &str) -> String {
        format!(
            "const TILE: u32 = 64u * 4u;
            override GIVEN: u32 = 4u;
            @group(0) @binding(0) var<storage, read_write> data: array<u32>;
            fn touch(p: ptr<function, u32>) {{ *p = 0u; }}
            @compute @workgroup_size(64)
            fn main(@builtin(local_invocation_index) lane: u32) {{ {body} }}"
        )
    }

    /// `all_end` of a shader that is valid.
    fn ends(body: &str) -> bool {
        let source = shader(body);
        let module = naga::front::wgsl::parse_str(&source).expect(body);
        let (flags, capabilities) = (
            naga::valid::ValidationFlags::all(),
            naga::valid::Capabilities::empty(),
        );
        let mut validator = naga::valid::Validator::new(flags, capabilities);
        validator.validate(&module).expect(body);
        all_end(&module)
    }

    #[test]
    fn loops_that_count_up_end() {
        for body in [
            "",
            "for (var i = 0u; i < TILE; i++) { data[i] = i; }",
            "for (var i = lane; i < TILE; i += 64u) { if data[i] == 0u { continue; } data[i] = 1u; }",
            // Whatever the bound, even one that grows.
            "for (var i = 0u; i < data[0]; i += 1u) { data[0] += 2u; }",
            "for (var i = 0u; i < 4294967040u; i += 256u) { data[lane] = i; }",
            "for (var i = 0u; i < 8u; i++) { for (var k = 0u; k < i; k++) { data[k] = i; } }",
            "var i = 0u; loop { if i < 9u {} else { break; } data[i] = 1u; continuing { i = i + 3u; } }",
        ] {
            assert!(ends(body), "{body}");
        }
    }

    #[test]
    fn of_others_it_is_not_known() {
        for body in [
            "loop { if data[0] == 1u { break; } }",
            "while data[0] < 4u { data[0]++; }",
            // Some of these do end.
            "for (var i = 9u; i > 0u; i--) { data[i] = i; }",
            "for (var i = 1u; i < TILE; i *= 2u) { data[i] = i; }",
            "for (var i = 0u; i <= data[0]; i++) { data[i] = i; }",
            "for (var i = 0u; i < GIVEN; i += 2u) { data[i] = i; }",
            // These wrap or stand still.
            "for (var i = 0u; i < data[0]; i += 256u) { data[i] = i; }",
            "for (var i = 0u; i < 4294967041u; i += 256u) { data[lane] = i; }",
            "for (var i = 0u; i < TILE; i += 0u) { data[i] = i; }",
            "for (var i = 0u; i < TILE; i += data[1]) { data[i] = i; }",
            // These begin again.
            "for (var i = 0u; i < TILE; i++) { if data[i] == 0u { i = 0u; } }",
            "for (var i = 0u; i < TILE; i++) { touch(&i); }",
            "for (var i = 0u; i < TILE; i++) { for (var k = 0u; k < 2u; k++) { i = k; } }",
            "for (var i = 0u; i < 9u; i++) { switch data[i] { case 1u: { i = 0u; } default: {} } }",
            "var k = 0u; for (var i = 0u; i < TILE; k++) { data[i] = k; }",
            "var k = 0u; for (var i = 0u; i < TILE; i = k + 1u) { data[i] = i; }",
            // These look once.
            "var i = 0u; let more = i < TILE; for (; more; i++) { data[i] = i; }",
            "var i = 0u; let first = i; for (; first < TILE; i++) { data[i] = i; }",
            "var i = 0u; let first = i; for (; i < TILE; i = first + 1u) { data[i] = i; }",
            // One of two.
            "for (var i = 0u; i < TILE; i++) { loop { if data[i] == 1u { break; } } }",
            "if lane == 0u { loop { if data[0] == 1u { break; } } }",
        ] {
            assert!(!ends(body), "{body}");
        }
    }

    #[test]
    fn functions_count_too() {
        let endless = "fn other() { loop { if data[0] == 1u { break; } } }";
        let module = naga::front::wgsl::parse_str(&(shader("") + endless));
        assert!(!all_end(&module.expect("a shader")));
    }
}
