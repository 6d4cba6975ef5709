//! Interpreter of compute shaders: runs entry points of linked shaders on the CPU, from naga's representation. Tests of integer logic need
//! no adapter.
//!
//! Invocations run one after the other. f32 operations run in the order of the shader's text, without contraction. An index out of bounds, a
//! read of an unbound buffer and unsupported features panic. Unsupported are barriers, workgroup and private variables, images, derivatives,
//! ray queries, f16 and 64-bit numbers.

mod eval;
mod math;
mod types;

use std::rc::Rc;

use naga::{Block, BuiltIn, Function, Handle, Statement, SwitchValue, proc::Layouter, valid::FunctionInfo};

use super::Memory;
use crate::{LinkedShader, shader::item_name};

/// Order in which the invocations of a dispatch run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// In the order of their indices.
    Forward,
    /// In reverse order.
    Backward,
}

/// The address of a value: a memory and a byte offset in it.
#[derive(Clone, Copy, Debug)]
struct Pointer {
    memory: usize,
    offset: usize,
}

/// A value. A composite is a sequence of its scalars, 32 bits each.
#[derive(Clone, Debug)]
enum Value {
    Scalars(Rc<[u32]>),
    Pointer(Pointer),
}

impl Value {
    fn scalars(&self) -> &[u32] {
        match self {
            Self::Scalars(scalars) => scalars,
            Self::Pointer(_) => panic!("a pointer where a value is needed"),
        }
    }

    fn pointer(&self) -> Pointer {
        match self {
            Self::Pointer(pointer) => *pointer,
            Self::Scalars(_) => panic!("a value where a pointer is needed"),
        }
    }
}

impl From<u32> for Value {
    fn from(word: u32) -> Self {
        Self::Scalars(Rc::new([word]))
    }
}

impl FromIterator<u32> for Value {
    fn from_iter<I: IntoIterator<Item = u32>>(words: I) -> Self {
        Self::Scalars(words.into_iter().collect())
    }
}

/// Control flow after a block.
enum Flow {
    Next,
    Break,
    Continue,
    Return(Option<Value>),
}

/// A call in progress.
struct Call<'a> {
    function: &'a Function,
    info: &'a FunctionInfo,
    arguments: Vec<Value>,
    /// Index of the memory of its first local variable; the others follow.
    locals: usize,
    /// Values of its expressions that were evaluated so far.
    values: Vec<Option<Value>>,
}

struct Machine<'a> {
    shader: &'a LinkedShader,
    layouter: Layouter,
    /// Contents of the bound buffers, then of local variables.
    memories: Vec<Vec<u8>>,
    /// Index of the memory of each global variable, if it is bound.
    globals: Vec<Option<usize>>,
}

impl Memory {
    /// Runs an entry point in the interpreter on these buffers.
    pub fn interpret(&mut self, shader: &LinkedShader, entry: &str, workgroups: [u32; 3], order: Order) {
        let bound = self.buffers.len();
        let mut machine = Machine::new(shader, self);
        let index = shader.entry_index(entry);
        let size = shader.workgroup_size(entry);
        let span = |axis: usize| workgroups[axis] * size[axis];
        let count = span(0) * span(1) * span(2);
        for i in 0..count {
            let i = if order == Order::Forward { i } else { count - 1 - i };
            let id = [i % span(0), i / span(0) % span(1), i / (span(0) * span(1))];
            machine.invoke(index, id, workgroups);
        }
        machine.memories.truncate(bound);
        self.buffers = machine.memories;
    }
}

impl<'a> Machine<'a> {
    fn new(shader: &'a LinkedShader, memory: &mut Memory) -> Self {
        let mut layouter = Layouter::default();
        layouter.update(shader.module.to_ctx()).expect("a validated module has layouts");
        let memories = std::mem::take(&mut memory.buffers);
        let name = |variable: &'a naga::GlobalVariable| item_name(variable.name.as_deref().unwrap_or_default());
        let variables = shader.module.global_variables.iter();
        let globals = variables.map(|(_, variable)| memory.names.get(name(variable)).copied()).collect();
        Self { shader, layouter, memories, globals }
    }

    fn invoke(&mut self, index: usize, id: [u32; 3], workgroups: [u32; 3]) {
        let shader = self.shader;
        let entry = &shader.module.entry_points[index];
        let size = entry.workgroup_size;
        let local = [0, 1, 2].map(|axis| id[axis] % size[axis]);
        let argument = |argument: &naga::FunctionArgument| match &argument.binding {
            Some(naga::Binding::BuiltIn(BuiltIn::GlobalInvocationId)) => Value::from_iter(id),
            Some(naga::Binding::BuiltIn(BuiltIn::LocalInvocationId)) => Value::from_iter(local),
            Some(naga::Binding::BuiltIn(BuiltIn::LocalInvocationIndex)) => {
                Value::from((local[2] * size[1] + local[1]) * size[0] + local[0])
            }
            Some(naga::Binding::BuiltIn(BuiltIn::WorkGroupId)) => {
                [0, 1, 2].map(|axis| id[axis] / size[axis]).into_iter().collect()
            }
            Some(naga::Binding::BuiltIn(BuiltIn::NumWorkGroups)) => Value::from_iter(workgroups),
            other => panic!("{}: {other:?} is not supported", entry.name),
        };
        let arguments = entry.function.arguments.iter().map(argument).collect();
        self.call(&entry.function, shader.info.get_entry_point(index), arguments);
    }

    fn call(&mut self, function: &'a Function, info: &'a FunctionInfo, arguments: Vec<Value>) -> Option<Value> {
        let locals = self.memories.len();
        let values = vec![None; function.expressions.len()];
        let mut call = Call { function, info, arguments, locals, values };
        for (_, variable) in function.local_variables.iter() {
            self.memories.push(vec![0; self.layouter[variable.ty].size as usize]);
        }
        for (index, (_, variable)) in function.local_variables.iter().enumerate() {
            if let Some(init) = variable.init {
                let value = self.value(&mut call, init);
                let ty = &self.shader.module.types[variable.ty].inner;
                self.store(ty, Pointer { memory: locals + index, offset: 0 }, value.scalars());
            }
        }
        let flow = self.block(&mut call, &function.body);
        self.memories.truncate(locals);
        match flow {
            Flow::Return(value) => value,
            _ => None,
        }
    }

    fn block(&mut self, call: &mut Call<'a>, block: &'a Block) -> Flow {
        for statement in block {
            let flow = self.statement(call, statement);
            if !matches!(flow, Flow::Next) {
                return flow;
            }
        }
        Flow::Next
    }

    fn statement(&mut self, call: &mut Call<'a>, statement: &'a Statement) -> Flow {
        match statement {
            Statement::Emit(range) => {
                for handle in range.clone() {
                    let value = self.evaluate(call, handle);
                    call.values[handle.index()] = Some(value);
                }
            }
            Statement::Block(block) => return self.block(call, block),
            Statement::If { condition, accept, reject } => {
                let is_true = self.value(call, *condition).scalars()[0] != 0;
                return self.block(call, if is_true { accept } else { reject });
            }
            Statement::Switch { selector, cases } => {
                let selected = self.value(call, *selector).scalars()[0];
                let is_it = |value: &SwitchValue| match value {
                    SwitchValue::I32(value) => *value as u32 == selected,
                    SwitchValue::U32(value) => *value == selected,
                    SwitchValue::Default => false,
                };
                let default = || cases.iter().position(|case| case.value == SwitchValue::Default);
                let first = cases.iter().position(|case| is_it(&case.value)).or_else(default).unwrap_or(cases.len());
                for case in &cases[first..] {
                    match self.block(call, &case.body) {
                        Flow::Next if case.fall_through => {}
                        Flow::Next | Flow::Break => break,
                        left => return left,
                    }
                }
            }
            Statement::Loop { body, continuing, break_if } => loop {
                match self.block(call, body) {
                    Flow::Next | Flow::Continue => {}
                    Flow::Break => break,
                    left => return left,
                }
                self.block(call, continuing);
                if break_if.is_some_and(|condition| self.value(call, condition).scalars()[0] != 0) {
                    break;
                }
            },
            Statement::Break => return Flow::Break,
            Statement::Continue => return Flow::Continue,
            Statement::Return { value } => return Flow::Return(value.map(|value| self.value(call, value))),
            Statement::Store { pointer, value } => {
                let (value, at) = (self.value(call, *value), self.value(call, *pointer).pointer());
                self.store(&self.pointee(call, *pointer), at, value.scalars());
            }
            Statement::Call { function, arguments, result } => {
                let arguments = arguments.iter().map(|argument| self.value(call, *argument)).collect();
                let shader = self.shader;
                let value = self.call(&shader.module.functions[*function], &shader.info[*function], arguments);
                if let Some(result) = result {
                    call.values[result.index()] = value;
                }
            }
            Statement::Atomic { pointer, fun, value, result } => self.atomic(call, (*pointer, *value), fun, *result),
            other => panic!("{}: {other:?} is not supported", self.shader.label),
        }
        Flow::Next
    }

    fn atomic(
        &mut self,
        call: &mut Call<'a>,
        (pointer, value): (Handle<naga::Expression>, Handle<naga::Expression>),
        fun: &naga::AtomicFunction,
        result: Option<Handle<naga::Expression>>,
    ) {
        let ty = self.pointee(call, pointer);
        let (at, value) = (self.value(call, pointer).pointer(), self.value(call, value).scalars()[0]);
        let is_signed = matches!(ty, naga::TypeInner::Atomic(naga::Scalar { kind: naga::ScalarKind::Sint, .. }));
        let old = self.load(&ty, at).scalars()[0];
        let mut exchanged = None;
        let new = match fun {
            naga::AtomicFunction::Add => old.wrapping_add(value),
            naga::AtomicFunction::Subtract => old.wrapping_sub(value),
            naga::AtomicFunction::And => old & value,
            naga::AtomicFunction::InclusiveOr => old | value,
            naga::AtomicFunction::ExclusiveOr => old ^ value,
            naga::AtomicFunction::Min if is_signed => (old as i32).min(value as i32) as u32,
            naga::AtomicFunction::Max if is_signed => (old as i32).max(value as i32) as u32,
            naga::AtomicFunction::Min => old.min(value),
            naga::AtomicFunction::Max => old.max(value),
            naga::AtomicFunction::Exchange { compare: None } => value,
            naga::AtomicFunction::Exchange { compare: Some(compare) } => {
                let is_same = self.value(call, *compare).scalars()[0] == old;
                exchanged = Some(u32::from(is_same));
                if is_same { value } else { old }
            }
        };
        self.store(&ty, at, &[new]);
        if let Some(result) = result {
            call.values[result.index()] = Some([old].into_iter().chain(exchanged).collect());
        }
    }
}

#[cfg(test)]
mod tests;
