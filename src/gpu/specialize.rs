//! Kernels without what their constants switch off. Drivers translate all of a module before they
//! find out what is never reached; most of a kernel for a plain scene is.

use std::collections::HashMap;

use wgpu::naga::{
    Block, Constant, Expression, Function, Handle, Literal, LocalVariable, Module, Span, Statement, UnaryOperator,
    compact::{KeepUnused, compact},
    front::wgsl::parse_str,
};

/// The kernel with its `override` constants fixed, without the branches that they never take and
/// what only these use; `None` where the text cannot be read so.
pub(super) fn specialized(wgsl: &str, constants: &[(&str, f64)]) -> Option<Module> {
    let mut module = parse_str(&with_constants(wgsl, constants)?).ok()?;
    let global = |constant: &Constant| literal_bool(&module.global_expressions[constant.init]);
    let constants = module.constants.iter().filter_map(|(h, c)| Some((h, global(c)?))).collect();
    let mut fixed = Fixed { constants, functions: HashMap::new() };
    // Functions come before those that call them.
    for (handle, function) in module.functions.iter_mut() {
        if let Some(value) = prune(function, &fixed) {
            fixed.functions.insert(handle, value);
        }
    }
    for entry in &mut module.entry_points {
        prune(&mut entry.function, &fixed);
    }
    compact(&mut module, KeepUnused::No);
    Some(module)
}

/// The text with `const` for each `override`, of the given value or its default.
fn with_constants(wgsl: &str, constants: &[(&str, f64)]) -> Option<String> {
    let fixed = |line: &str| {
        let Some(declared) = line.strip_prefix("override ") else { return Some(line.to_owned()) };
        let (name, rest) = declared.split_once(':')?;
        let (kind, default) = rest.strip_suffix(';')?.split_once('=')?;
        let given = constants.iter().find(|(given, _)| *given == name.trim()).map(|(_, value)| *value);
        let value = match (given, kind.trim()) {
            (None, _) => default.trim().to_owned(),
            (Some(value), "bool") => (value != 0.0).to_string(),
            (Some(value), "u32") => format!("{}u", value as u32),
            (Some(value), "f32") => format!("{:e}f", value as f32),
            (Some(_), _) => return None,
        };
        Some(format!("const {name}:{kind}= {value};"))
    };
    Some(wgsl.lines().map(fixed).collect::<Option<Vec<_>>>()?.join("\n"))
}

/// Conditions of one value: constants, and results of functions.
struct Fixed {
    constants: HashMap<Handle<Constant>, bool>,
    functions: HashMap<Handle<Function>, bool>,
}

fn literal_bool(expression: &Expression) -> Option<bool> {
    match expression {
        Expression::Literal(Literal::Bool(value)) => Some(*value),
        _ => None,
    }
}

/// Leaves out branches that are never taken, and those that a variable decides that they fix.
/// Returns the result of the function, if it has one alone.
fn prune(function: &mut Function, fixed: &Fixed) -> Option<bool> {
    // Names would keep alive what they stand for.
    function.named_expressions.clear();
    let mut variables = HashMap::new();
    loop {
        let body = std::mem::take(&mut function.body);
        function.body = Pruning { function, fixed, variables: &variables }.block(body);
        let (found, result) = fixed_variables(&Pruning { function, fixed, variables: &variables });
        if found.len() == variables.len() {
            return result;
        }
        variables = found;
    }
}

/// The value that all have, if they have one.
fn common(values: &[Option<bool>]) -> Option<bool> {
    let (first, rest) = values.split_first()?;
    first.filter(|_| rest.iter().all(|value| value == first))
}

/// Variables of the language's front end that hold `a && b` or `a || b`, those without a name,
/// where all that is stored has one value; and what the function returns, if that has.
fn fixed_variables(pruning: &Pruning) -> (HashMap<Handle<LocalVariable>, bool>, Option<bool>) {
    let (function, mut results) = (pruning.function, Vec::new());
    let mut stores: HashMap<Handle<LocalVariable>, Vec<Option<bool>>> = HashMap::new();
    let mut waiting = vec![&function.body];
    while let Some(block) = waiting.pop() {
        for statement in block {
            match statement {
                Statement::Block(inner) => waiting.push(inner),
                Statement::If { accept, reject, .. } => waiting.extend([accept, reject]),
                Statement::Switch { cases, .. } => waiting.extend(cases.iter().map(|case| &case.body)),
                Statement::Loop { body, continuing, .. } => waiting.extend([body, continuing]),
                Statement::Store { pointer, value } => {
                    if let Expression::LocalVariable(variable) = function.expressions[*pointer] {
                        stores.entry(variable).or_default().push(pruning.value(*value));
                    }
                }
                Statement::Return { value } => results.push(value.and_then(|value| pruning.value(value))),
                _ => {}
            }
        }
    }
    let is_of_front_end = |variable: Handle<LocalVariable>| {
        let variable = &function.local_variables[variable];
        variable.name.is_none() && variable.init.is_none()
    };
    let ours = stores.into_iter().filter(|(variable, _)| is_of_front_end(*variable));
    (ours.filter_map(|(variable, values)| Some((variable, common(&values)?))).collect(), common(&results))
}

struct Pruning<'a> {
    function: &'a Function,
    fixed: &'a Fixed,
    variables: &'a HashMap<Handle<LocalVariable>, bool>,
}

impl Pruning<'_> {
    /// Value of a condition, where it is fixed.
    fn value(&self, condition: Handle<Expression>) -> Option<bool> {
        match self.function.expressions[condition] {
            Expression::Literal(Literal::Bool(value)) => Some(value),
            Expression::Constant(constant) => self.fixed.constants.get(&constant).copied(),
            Expression::CallResult(function) => self.fixed.functions.get(&function).copied(),
            Expression::Unary { op: UnaryOperator::LogicalNot, expr } => Some(!self.value(expr)?),
            Expression::Load { pointer } => match self.function.expressions[pointer] {
                Expression::LocalVariable(variable) => self.variables.get(&variable).copied(),
                _ => None,
            },
            _ => None,
        }
    }

    fn block(&self, block: Block) -> Block {
        let mut kept = Block::with_capacity(block.len());
        for (statement, span) in block.span_into_iter() {
            self.add(&mut kept, statement, span);
            // Nothing may stand behind a return that is now reached for certain.
            if ends(&kept) {
                break;
            }
        }
        kept
    }

    fn add(&self, kept: &mut Block, statement: Statement, span: Span) {
        let statement = match statement {
            Statement::If { condition, accept, reject } => match self.value(condition) {
                Some(taken) => return kept.extend_block(self.block(if taken { accept } else { reject })),
                None => Statement::If { condition, accept: self.block(accept), reject: self.block(reject) },
            },
            Statement::Switch { selector, mut cases } => {
                cases.iter_mut().for_each(|case| case.body = self.block(std::mem::take(&mut case.body)));
                Statement::Switch { selector, cases }
            }
            Statement::Loop { body, continuing, break_if } => {
                Statement::Loop { body: self.block(body), continuing: self.block(continuing), break_if }
            }
            Statement::Block(inner) => Statement::Block(self.block(inner)),
            other => other,
        };
        kept.push(statement, span);
    }
}

/// Whether what follows a block is never reached.
fn ends(block: &Block) -> bool {
    match block.last() {
        Some(Statement::Return { .. } | Statement::Break | Statement::Continue | Statement::Kill) => true,
        Some(Statement::Block(inner)) => ends(inner),
        Some(Statement::If { accept, reject, .. }) => ends(accept) && ends(reject),
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use wgpu::naga::valid::{Capabilities, ValidationFlags, Validator};

    use super::*;
    use crate::gpu::shaders::SHADERS;

    /// Size of a module: expressions of all functions.
    fn size(module: &Module) -> usize {
        let functions = module.functions.iter().map(|(_, f)| f.expressions.len()).sum::<usize>();
        functions + module.entry_points.iter().map(|e| e.function.expressions.len()).sum::<usize>()
    }

    #[test]
    fn every_kernel_is_specialized_and_valid() {
        for shader in SHADERS {
            for value in [0.0, 0.35, 1.0] {
                let names =
                    shader.overrides.iter().filter(|name| name.starts_with("HAS_") || name.ends_with("ROUGHNESS"));
                let constants: Vec<_> = names.map(|name| (*name, value)).collect();
                let module = specialized(shader.wgsl, &constants).unwrap_or_else(|| panic!("{}", shader.stem));
                assert!(module.overrides.is_empty());
                let checked = Validator::new(ValidationFlags::all(), Capabilities::all()).validate(&module);
                assert!(checked.is_ok(), "{}: {:?}", shader.stem, checked.err());
            }
        }
    }

    #[test]
    fn what_constants_switch_off_is_left_out() {
        let text = "
            override ON: bool = false;
            override COUNT: u32 = 1u;
            @group(0) @binding(0) var<storage, read_write> out: array<f32>;
            @group(0) @binding(1) var<storage, read> far: array<f32>;
            fn costly(x: f32) -> f32 { return far[u32(x)] + 1.0; }
            fn early(x: f32) -> f32 { if (!ON) { return x; } return costly(costly(x)); }
            fn is_large(x: f32) -> bool { return x > 3.0 && ON; }
            @compute @workgroup_size(1) fn main() {
                let big = ON && out[0] > 1.0 || COUNT == 7u;
                if (big && out[1] > 2.0) { out[2] = costly(out[1]); }
                if (is_large(out[5])) { out[5] = costly(1.0); }
                for (var i = 0u; i < COUNT; i++) { out[3] += early(out[4]); }
            }";
        let text = text.replace("\n            ", "\n");
        let [off, on, seven] = [vec![], vec![("ON", 1.0)], vec![("COUNT", 7.0)]]
            .map(|constants| specialized(&text, &constants).expect("it is read"));
        assert_eq!((off.functions.len(), off.global_variables.len()), (2, 1), "{off:#?}");
        assert_eq!((on.functions.len(), on.global_variables.len()), (3, 2), "control: all of it is used");
        assert_eq!((seven.functions.len(), seven.global_variables.len()), (3, 2), "control: by a number");
        assert!(size(&off) < size(&seven) && size(&seven) < size(&on));
        assert!(specialized("override A: vec2f = 1;", &[("A", 1.0)]).is_none() && specialized("fn", &[]).is_none());
    }
}
