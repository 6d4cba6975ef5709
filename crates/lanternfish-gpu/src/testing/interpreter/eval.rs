//! Values of expressions.

use naga::{Arena, Expression, Handle, Literal, ScalarKind, TypeInner};

use super::{Call, Machine, Pointer, Value, math};

impl<'a> Machine<'a> {
    /// The value of an expression that was emitted, or that needs no emission.
    pub(super) fn value(&mut self, call: &mut Call<'a>, expression: Handle<Expression>) -> Value {
        if let Some(value) = &call.values[expression.index()] {
            return value.clone();
        }
        let value = self.evaluate(call, expression);
        call.values[expression.index()] = Some(value.clone());
        value
    }

    pub(super) fn evaluate(&mut self, call: &mut Call<'a>, expression: Handle<Expression>) -> Value {
        let function = call.function;
        match &function.expressions[expression] {
            Expression::FunctionArgument(index) => call.arguments[*index as usize].clone(),
            Expression::LocalVariable(variable) => {
                Value::Pointer(Pointer { memory: call.locals + variable.index(), offset: 0 })
            }
            Expression::GlobalVariable(variable) => {
                let memory = self.globals[variable.index()];
                let name = || &self.shader.module.global_variables[*variable].name;
                Value::Pointer(Pointer {
                    memory: memory.unwrap_or_else(|| panic!("{:?} is not bound", name())),
                    offset: 0,
                })
            }
            Expression::Load { pointer } => {
                let at = self.value(call, *pointer).pointer();
                self.load(&self.pointee(call, *pointer), at)
            }
            Expression::ArrayLength(array) => {
                let at = self.value(call, *array).pointer();
                self.array_length(&self.pointee(call, *array), at).into()
            }
            Expression::Access { base, index } => {
                let index = self.value(call, *index).scalars()[0] as usize;
                self.access(call, *base, index)
            }
            Expression::AccessIndex { base, index } => self.access(call, *base, *index as usize),
            Expression::Compose { components, .. } => {
                components.iter().flat_map(|part| self.value(call, *part).scalars().to_vec()).collect()
            }
            Expression::Splat { size, value } => {
                let word = self.value(call, *value).scalars()[0];
                std::iter::repeat_n(word, *size as usize).collect()
            }
            Expression::Swizzle { size, vector, pattern } => {
                let vector = self.value(call, *vector);
                pattern[..*size as usize].iter().map(|component| vector.scalars()[*component as usize]).collect()
            }
            Expression::Unary { op, expr } => {
                let (kind, value) = (self.kind(call, *expr), self.value(call, *expr));
                value.scalars().iter().map(|word| math::unary(*op, kind, *word)).collect()
            }
            Expression::Binary { op, left, right } => {
                let types = [self.type_of(call, *left), self.type_of(call, *right)];
                let (left_value, right_value) = (self.value(call, *left), self.value(call, *right));
                let kind = self.kind(call, *left);
                math::binary(*op, kind, types, left_value.scalars(), right_value.scalars()).into_iter().collect()
            }
            Expression::Select { condition, accept, reject } => {
                let [condition, accept, reject] = [*condition, *accept, *reject].map(|part| self.value(call, part));
                let (condition, accept, reject) = (condition.scalars(), accept.scalars(), reject.scalars());
                let is_hit = |i: usize| condition[if condition.len() == 1 { 0 } else { i }] != 0;
                (0..accept.len()).map(|i| if is_hit(i) { accept[i] } else { reject[i] }).collect()
            }
            Expression::Relational { fun, argument } => {
                let value = self.value(call, *argument);
                math::relational(*fun, value.scalars())
            }
            Expression::Math { fun, arg, arg1, arg2, arg3 } => {
                let kind = self.kind(call, *arg);
                let arguments = [Some(*arg), *arg1, *arg2, *arg3].into_iter().flatten();
                let arguments: Vec<Value> = arguments.map(|argument| self.value(call, argument)).collect();
                let arguments: Vec<&[u32]> = arguments.iter().map(Value::scalars).collect();
                math::function(*fun, kind, &arguments).into_iter().collect()
            }
            Expression::As { expr, kind, convert } => {
                let (from, value) = (self.kind(call, *expr), self.value(call, *expr));
                value
                    .scalars()
                    .iter()
                    .map(|word| if convert.is_some() { math::convert(from, *kind, *word) } else { *word })
                    .collect()
            }
            constant => {
                let arena = &function.expressions;
                self.constant(arena, constant)
            }
        }
    }

    /// The value of a constant expression.
    fn constant(&self, arena: &'a Arena<Expression>, expression: &'a Expression) -> Value {
        let module = &self.shader.module;
        match expression {
            Expression::Literal(literal) => literal_bits(*literal).into(),
            Expression::Constant(constant) => {
                let global = &module.global_expressions;
                self.constant(global, &global[module.constants[*constant].init])
            }
            Expression::ZeroValue(ty) => std::iter::repeat_n(0, self.count(&module.types[*ty].inner)).collect(),
            Expression::Compose { components, .. } => {
                components.iter().flat_map(|part| self.constant(arena, &arena[*part]).scalars().to_vec()).collect()
            }
            Expression::Splat { size, value } => {
                let word = self.constant(arena, &arena[*value]).scalars()[0];
                std::iter::repeat_n(word, *size as usize).collect()
            }
            other => panic!("{}: {other:?} is not supported", self.shader.label),
        }
    }

    /// An element of a composite, or a pointer to it.
    fn access(&mut self, call: &mut Call<'a>, base: Handle<Expression>, index: usize) -> Value {
        match self.value(call, base) {
            Value::Pointer(Pointer { memory, offset }) => {
                let offset = offset + self.element_offset(&self.pointee(call, base), index);
                assert!(offset < self.memories[memory].len(), "{}: index {index} is out of bounds", self.shader.label);
                Value::Pointer(Pointer { memory, offset })
            }
            Value::Scalars(words) => {
                let range = self.element_scalars(self.type_of(call, base), index);
                words[range].iter().copied().collect()
            }
        }
    }

    /// Kind of the scalars of an expression.
    fn kind(&self, call: &Call<'a>, expression: Handle<Expression>) -> ScalarKind {
        match self.type_of(call, expression) {
            TypeInner::Scalar(scalar) | TypeInner::Vector { scalar, .. } | TypeInner::Matrix { scalar, .. } => {
                assert!(scalar.width == 4 || scalar.kind == ScalarKind::Bool, "{scalar:?} is not supported");
                scalar.kind
            }
            other => panic!("{other:?} has no scalars of one kind"),
        }
    }
}

fn literal_bits(literal: Literal) -> u32 {
    match literal {
        Literal::F32(value) => value.to_bits(),
        Literal::U32(value) => value,
        Literal::I32(value) => value as u32,
        Literal::Bool(value) => value.into(),
        other => panic!("{other:?} is not supported"),
    }
}
