//! Conditions on uniforms that a driver cannot settle beforehand.
//!
//! Lavapipe looks for conditions on the words of uniform buffers and, where their values would let
//! it leave out half of a kernel, translates the kernel anew for each dispatch and keeps all of
//! these: a render takes ten times as long and gigabytes. Here each such condition is put together
//! with a flag that is false in every invocation, which the driver cannot know.

use wgpu::naga::{
    AddressSpace, BinaryOperator, Binding, Block, BuiltIn, Expression, Function, GlobalVariable, Handle, Literal,
    MemoryDecorations, Module, Range, Scalar, Span, Statement, Type, TypeInner,
};

/// Hides the uniforms in the conditions of a kernel. One whose invocations have no numbers stays.
pub(super) fn hide_uniforms(module: &mut Module) {
    let [entry] = module.entry_points.as_slice() else { return };
    let is_number = |binding: &Option<Binding>| *binding == Some(Binding::BuiltIn(BuiltIn::GlobalInvocationId));
    let Some(number) = entry.function.arguments.iter().position(|argument| is_number(&argument.binding)) else {
        return;
    };
    let uniforms: Vec<Handle<GlobalVariable>> =
        module.global_variables.iter().filter(|(_, v)| v.space == AddressSpace::Uniform).map(|(h, _)| h).collect();
    let types: Vec<Handle<Type>> = uniforms.iter().map(|variable| module.global_variables[*variable].ty).collect();
    let inner = TypeInner::Scalar(Scalar::BOOL);
    let ty = module.types.insert(Type { name: None, inner }, Span::UNDEFINED);
    let flag = GlobalVariable {
        name: Some("never".to_owned()),
        space: AddressSpace::Private,
        binding: None,
        ty,
        init: None,
        memory_decorations: MemoryDecorations::empty(),
    };
    let flag = module.global_variables.append(flag, Span::UNDEFINED);
    for (_, function) in module.functions.iter_mut() {
        hide_in(function, flag, (&uniforms, &types));
    }
    let entry = &mut module.entry_points[0].function;
    hide_in(entry, flag, (&uniforms, &types));
    set_flag(entry, flag, number as u32);
}

/// Sets the flag before all else: whether the number of the invocation is one that none has.
fn set_flag(entry: &mut Function, flag: Handle<GlobalVariable>, number: u32) {
    let mut add = |expression| entry.expressions.append(expression, Span::UNDEFINED);
    let pointer = add(Expression::GlobalVariable(flag));
    let right = add(Expression::Literal(Literal::U32(u32::MAX)));
    let base = add(Expression::FunctionArgument(number));
    let left = add(Expression::AccessIndex { base, index: 0 });
    let value = add(Expression::Binary { op: BinaryOperator::Equal, left, right });
    let first = [Statement::Emit(Range::new_from_bounds(left, value)), Statement::Store { pointer, value }];
    let mut body = Block::from_vec(first.into());
    body.extend_block(std::mem::take(&mut entry.body));
    entry.body = body;
}

/// What all that an expression is made of is at most: a driver settles conditions on uniforms and
/// numbers alone, and those on a counter of a loop besides.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Leaves {
    Numbers,
    Uniforms,
    Any,
}

/// Hides uniforms, and arguments of types that uniforms have, in the conditions of a function.
fn hide_in(
    function: &mut Function,
    flag: Handle<GlobalVariable>,
    (uniforms, types): (&[Handle<GlobalVariable>], &[Handle<Type>]),
) {
    let mut made = vec![Leaves::Any; function.expressions.len()];
    let uniform_if = |is_one| if is_one { Leaves::Uniforms } else { Leaves::Any };
    for (handle, expression) in function.expressions.iter() {
        let of = |part: &Handle<Expression>| made[part.index()];
        made[handle.index()] = match expression {
            Expression::Literal(_)
            | Expression::Constant(_)
            | Expression::ZeroValue(_)
            | Expression::LocalVariable(_) => Leaves::Numbers,
            Expression::GlobalVariable(variable) => uniform_if(uniforms.contains(variable)),
            Expression::FunctionArgument(index) => uniform_if(types.contains(&function.arguments[*index as usize].ty)),
            Expression::Compose { components, .. } => components.iter().map(of).max().unwrap_or(Leaves::Numbers),
            Expression::AccessIndex { base: part, .. }
            | Expression::Splat { value: part, .. }
            | Expression::Swizzle { vector: part, .. }
            | Expression::Load { pointer: part }
            | Expression::Unary { expr: part, .. }
            | Expression::Relational { argument: part, .. }
            | Expression::As { expr: part, .. } => of(part),
            Expression::Access { base: left, index: right } | Expression::Binary { left, right, .. } => {
                of(left).max(of(right))
            }
            Expression::Select { condition, accept, reject } => of(condition).max(of(accept)).max(of(reject)),
            Expression::Math { arg, arg1, arg2, arg3, .. } => {
                [arg1, arg2, arg3].into_iter().flatten().map(of).fold(of(arg), Leaves::max)
            }
            _ => Leaves::Any,
        };
    }
    if !made.contains(&Leaves::Uniforms) {
        return;
    }
    let pointer = function.expressions.append(Expression::GlobalVariable(flag), Span::UNDEFINED);
    let body = std::mem::take(&mut function.body);
    function.body = Hiding { function, pointer, made }.block(body);
}

struct Hiding<'a> {
    function: &'a mut Function,
    /// The flag.
    pointer: Handle<Expression>,
    made: Vec<Leaves>,
}

impl Hiding<'_> {
    fn block(&mut self, block: Block) -> Block {
        let mut hidden = Block::with_capacity(block.len());
        for (statement, span) in block.span_into_iter() {
            let statement = match statement {
                Statement::If { condition, accept, reject } => {
                    let condition = self.hidden(condition, &mut hidden);
                    Statement::If { condition, accept: self.block(accept), reject: self.block(reject) }
                }
                Statement::Switch { selector, mut cases } => {
                    cases.iter_mut().for_each(|case| case.body = self.block(std::mem::take(&mut case.body)));
                    Statement::Switch { selector, cases }
                }
                Statement::Loop { body, continuing, break_if } => {
                    let (body, mut continuing) = (self.block(body), self.block(continuing));
                    let break_if = break_if.map(|condition| self.hidden(condition, &mut continuing));
                    Statement::Loop { body, continuing, break_if }
                }
                Statement::Block(inner) => Statement::Block(self.block(inner)),
                other => other,
            };
            hidden.push(statement, span);
        }
        hidden
    }

    /// The condition with the flag, computed at the end of a block, if it is made of uniforms.
    fn hidden(&mut self, condition: Handle<Expression>, before: &mut Block) -> Handle<Expression> {
        if self.made[condition.index()] != Leaves::Uniforms {
            return condition;
        }
        let mut add = |expression| self.function.expressions.append(expression, Span::UNDEFINED);
        let right = add(Expression::Load { pointer: self.pointer });
        let either = add(Expression::Binary { op: BinaryOperator::LogicalOr, left: condition, right });
        before.push(Statement::Emit(Range::new_from_bounds(right, either)), Span::UNDEFINED);
        either
    }
}

#[cfg(test)]
mod tests {
    use wgpu::naga::{
        front::wgsl::parse_str,
        valid::{Capabilities, ValidationFlags, Validator},
    };

    use super::*;
    use crate::gpu::{shaders::SHADERS, specialize::specialized};

    /// Number of conditions with the flag in all functions.
    fn hidden(module: &Module) -> usize {
        let all = module.functions.iter().map(|(_, function)| function);
        let flag = module.global_variables.iter().find(|(_, v)| v.name.as_deref() == Some("never")).map(|(h, _)| h);
        let is_flag = |function: &Function, pointer: Handle<Expression>| {
            flag.is_some_and(|flag| function.expressions[pointer] == Expression::GlobalVariable(flag))
        };
        let loads = |function: &Function| {
            let all = function.expressions.iter();
            all.filter(|(_, e)| matches!(e, Expression::Load { pointer } if is_flag(function, *pointer))).count()
        };
        all.chain(module.entry_points.iter().map(|entry| &entry.function)).map(loads).sum()
    }

    fn is_valid(module: &Module) -> bool {
        Validator::new(ValidationFlags::all(), Capabilities::all()).validate(module).is_ok()
    }

    #[test]
    fn conditions_on_uniforms_have_the_flag_and_others_not() {
        let text = "
            struct Info { count: u32, on: u32 }
            @group(0) @binding(0) var<uniform> info: Info;
            @group(0) @binding(1) var<storage, read_write> out: array<u32>;
            fn is_on(given: Info) -> bool { if (given.on == 1u) { return true; } return false; }
            @compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3u) {
                if (id.x >= info.count) { return; }
                if (info.count == 0u) { return; }
                if (out[id.x] == 3u) { out[id.x] = 4u; }
                for (var i = 0u; i < info.count; i++) { out[i] += 1u; }
                loop { out[0] += 1u; continuing { break if (info.on < 2u); } }
                if (is_on(info)) { out[1] = 1u; }
            }";
        let mut module = parse_str(text).expect("WGSL");
        assert_eq!(hidden(&module), 0);
        hide_uniforms(&mut module);
        assert!(is_valid(&module), "{module:#?}");
        assert_eq!(hidden(&module), 4, "but those on numbers of invocations, storage and results of functions");
    }

    #[test]
    fn every_kernel_stays_valid() {
        for shader in SHADERS {
            let mut module = specialized(shader.wgsl, &[]).expect("it is read");
            hide_uniforms(&mut module);
            assert!(is_valid(&module), "{}", shader.stem);
            assert!(hidden(&module) > 0 || !["trace_camera", "bounce_photons"].contains(&shader.stem));
        }
    }
}
