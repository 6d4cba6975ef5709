//! Operators and built-in functions on 32-bit scalars.

use naga::{BinaryOperator as Op, MathFunction as Fun, RelationalFunction, ScalarKind, TypeInner, UnaryOperator};

use super::Value;

fn f32_of(word: u32) -> f32 {
    f32::from_bits(word)
}

pub(super) fn unary(op: UnaryOperator, kind: ScalarKind, word: u32) -> u32 {
    match (op, kind) {
        (UnaryOperator::Negate, ScalarKind::Float) => (-f32_of(word)).to_bits(),
        (UnaryOperator::Negate, _) => word.wrapping_neg(),
        (UnaryOperator::LogicalNot, _) => u32::from(word == 0),
        (UnaryOperator::BitwiseNot, _) => !word,
    }
}

pub(super) fn binary(op: Op, kind: ScalarKind, types: [&TypeInner; 2], left: &[u32], right: &[u32]) -> Vec<u32> {
    if op == Op::Multiply {
        match types {
            [TypeInner::Matrix { rows, .. }, TypeInner::Vector { .. }] => {
                return transformed(left, *rows as usize, right);
            }
            [TypeInner::Vector { .. }, TypeInner::Matrix { rows, .. }] => {
                return right.chunks(*rows as usize).map(|column| dot(left, column).to_bits()).collect();
            }
            [TypeInner::Matrix { .. }, TypeInner::Matrix { .. }] => panic!("this product of matrices is not supported"),
            _ => {}
        }
    }
    let at = |side: &[u32], i: usize| side[if side.len() == 1 { 0 } else { i }];
    (0..left.len().max(right.len())).map(|i| operator(op, kind, at(left, i), at(right, i))).collect()
}

fn dot(left: &[u32], right: &[u32]) -> f32 {
    let product = |i: usize| f32_of(left[i]) * f32_of(right[i]);
    (1..left.len()).fold(product(0), |sum, i| sum + product(i))
}

/// Columns one after the other, first to last.
fn transformed(matrix: &[u32], rows: usize, vector: &[u32]) -> Vec<u32> {
    let product = |row: usize, column: usize| f32_of(matrix[column * rows + row]) * f32_of(vector[column]);
    (0..rows)
        .map(|row| (1..vector.len()).fold(product(row, 0), |sum, column| sum + product(row, column)).to_bits())
        .collect()
}

fn operator(op: Op, kind: ScalarKind, left: u32, right: u32) -> u32 {
    match kind {
        ScalarKind::Float => {
            let (a, b) = (f32_of(left), f32_of(right));
            match op {
                Op::Add => (a + b).to_bits(),
                Op::Subtract => (a - b).to_bits(),
                Op::Multiply => (a * b).to_bits(),
                Op::Divide => (a / b).to_bits(),
                Op::Modulo => (a % b).to_bits(),
                _ => compared(op, a.partial_cmp(&b)),
            }
        }
        ScalarKind::Sint => {
            let (a, b) = (left as i32, right as i32);
            match op {
                Op::Divide => a.checked_div(b).unwrap_or(a) as u32,
                Op::Modulo => a.checked_rem(b).unwrap_or(0) as u32,
                Op::ShiftRight => (a >> (right & 31)) as u32,
                Op::Less | Op::LessEqual | Op::Greater | Op::GreaterEqual => compared(op, Some(a.cmp(&b))),
                _ => of_bits(op, left, right),
            }
        }
        _ => of_bits(op, left, right),
    }
}

fn of_bits(op: Op, a: u32, b: u32) -> u32 {
    match op {
        Op::Add => a.wrapping_add(b),
        Op::Subtract => a.wrapping_sub(b),
        Op::Multiply => a.wrapping_mul(b),
        // WGSL: x / 0 = x, x % 0 = 0.
        Op::Divide => a.checked_div(b).unwrap_or(a),
        Op::Modulo => a.checked_rem(b).unwrap_or(0),
        Op::And | Op::LogicalAnd => a & b,
        Op::InclusiveOr | Op::LogicalOr => a | b,
        Op::ExclusiveOr => a ^ b,
        Op::ShiftLeft => a << (b & 31),
        Op::ShiftRight => a >> (b & 31),
        _ => compared(op, Some(a.cmp(&b))),
    }
}

/// The result of a comparison. `None` means unordered: an operand is NaN.
fn compared(op: Op, order: Option<std::cmp::Ordering>) -> u32 {
    let holds = match op {
        Op::Equal => order.is_some_and(std::cmp::Ordering::is_eq),
        Op::NotEqual => !order.is_some_and(std::cmp::Ordering::is_eq),
        Op::Less => order.is_some_and(std::cmp::Ordering::is_lt),
        Op::LessEqual => order.is_some_and(std::cmp::Ordering::is_le),
        Op::Greater => order.is_some_and(std::cmp::Ordering::is_gt),
        Op::GreaterEqual => order.is_some_and(std::cmp::Ordering::is_ge),
        other => panic!("{other:?} of these is not supported"),
    };
    holds.into()
}

pub(super) fn relational(fun: RelationalFunction, words: &[u32]) -> Value {
    match fun {
        RelationalFunction::All => u32::from(words.iter().all(|word| *word != 0)).into(),
        RelationalFunction::Any => u32::from(words.iter().any(|word| *word != 0)).into(),
        RelationalFunction::IsNan => words.iter().map(|word| u32::from(f32_of(*word).is_nan())).collect(),
        RelationalFunction::IsInf => words.iter().map(|word| u32::from(f32_of(*word).is_infinite())).collect(),
    }
}

/// Converts to another kind of scalar. Values out of range saturate.
pub(super) fn convert(from: ScalarKind, to: ScalarKind, word: u32) -> u32 {
    use ScalarKind::{Bool, Float, Sint, Uint};
    match (from, to) {
        (Float, Uint) => f32_of(word) as u32,
        (Float, Sint) => f32_of(word) as i32 as u32,
        (Float, Bool) => u32::from(f32_of(word) != 0.0),
        (Sint, Float) => (word as i32 as f32).to_bits(),
        (Uint | Bool, Float) => (word as f32).to_bits(),
        (_, Bool) => u32::from(word != 0),
        _ => word,
    }
}

pub(super) fn function(fun: Fun, kind: ScalarKind, arguments: &[&[u32]]) -> Vec<u32> {
    match kind {
        ScalarKind::Float => of_floats(fun, arguments),
        _ => of_integers(fun, kind, arguments),
    }
}

/// One component of each argument.
type Arguments<'a> = dyn Fn(usize) -> f32 + 'a;

fn of_floats(fun: Fun, arguments: &[&[u32]]) -> Vec<u32> {
    let vectors: Vec<Vec<f32>> =
        arguments.iter().map(|words| words.iter().map(|word| f32_of(*word)).collect()).collect();
    let a = &vectors[0];
    let dot = |b: &[f32]| (1..a.len()).fold(a[0] * b[0], |sum, i| sum + a[i] * b[i]);
    // A scalar argument next to vectors applies to each component.
    let at = |j: usize, i: usize| vectors[j][if vectors[j].len() == 1 { 0 } else { i }];
    let each = |apply: &dyn Fn(&Arguments) -> f32| -> Vec<u32> {
        (0..a.len()).map(|i| apply(&|j| at(j, i)).to_bits()).collect()
    };
    let snorm = |value: f32| ((0.5 + 32767.0 * value.clamp(-1.0, 1.0)).floor() as i32 & 0xffff) as u32;
    match fun {
        Fun::Abs => each(&|x| x(0).abs()),
        Fun::Min => each(&|x| x(0).min(x(1))),
        Fun::Max => each(&|x| x(0).max(x(1))),
        Fun::Clamp => each(&|x| x(0).max(x(1)).min(x(2))),
        Fun::Saturate => each(&|x| x(0).clamp(0.0, 1.0)),
        Fun::Floor => each(&|x| x(0).floor()),
        Fun::Ceil => each(&|x| x(0).ceil()),
        Fun::Trunc => each(&|x| x(0).trunc()),
        Fun::Round => each(&|x| x(0).round_ties_even()),
        Fun::Fract => each(&|x| x(0) - x(0).floor()),
        Fun::Sqrt => each(&|x| x(0).sqrt()),
        Fun::Sin => each(&|x| x(0).sin()),
        Fun::Cos => each(&|x| x(0).cos()),
        Fun::Exp => each(&|x| x(0).exp()),
        Fun::InverseSqrt => each(&|x| 1.0 / x(0).sqrt()),
        Fun::Mix => each(&|x| x(0) * (1.0 - x(2)) + x(1) * x(2)),
        Fun::Fma => each(&|x| x(0).mul_add(x(1), x(2))),
        Fun::Pow => each(&|x| x(0).powf(x(1))),
        Fun::Sign => each(&|x| if x(0) == 0.0 { 0.0 } else { x(0).signum() }),
        Fun::Dot => vec![dot(&vectors[1]).to_bits()],
        Fun::Length => vec![dot(a).sqrt().to_bits()],
        Fun::Normalize => a.iter().map(|x| (x / dot(a).sqrt()).to_bits()).collect(),
        Fun::Cross => {
            let b = &vectors[1];
            let part = |i: usize, j: usize| (a[i] * b[j] - a[j] * b[i]).to_bits();
            vec![part(1, 2), part(2, 0), part(0, 1)]
        }
        Fun::Pack2x16snorm => vec![snorm(a[0]) | (snorm(a[1]) << 16)],
        other => panic!("{other:?} of floats is not supported"),
    }
}

fn of_integers(fun: Fun, kind: ScalarKind, arguments: &[&[u32]]) -> Vec<u32> {
    let a = arguments[0];
    let is_signed = kind == ScalarKind::Sint;
    let smaller = |x: u32, y: u32| if is_signed { (x as i32).min(y as i32) as u32 } else { x.min(y) };
    let larger = |x: u32, y: u32| if is_signed { (x as i32).max(y as i32) as u32 } else { x.max(y) };
    let at = |j: usize, i: usize| arguments[j][if arguments[j].len() == 1 { 0 } else { i }];
    let each = |apply: &dyn Fn(usize) -> u32| (0..a.len()).map(apply).collect::<Vec<_>>();
    let snorm = |half: u32| (f32::from(half as u16 as i16) / 32767.0).max(-1.0).to_bits();
    match fun {
        Fun::Min => each(&|i| smaller(a[i], at(1, i))),
        Fun::Max => each(&|i| larger(a[i], at(1, i))),
        Fun::Clamp => each(&|i| smaller(larger(a[i], at(1, i)), at(2, i))),
        Fun::Abs if is_signed => each(&|i| (a[i] as i32).unsigned_abs()),
        Fun::FirstTrailingBit => each(&|i| if a[i] == 0 { u32::MAX } else { a[i].trailing_zeros() }),
        Fun::CountTrailingZeros => each(&|i| a[i].trailing_zeros()),
        Fun::CountLeadingZeros => each(&|i| a[i].leading_zeros()),
        Fun::CountOneBits => each(&|i| a[i].count_ones()),
        Fun::ReverseBits => each(&|i| a[i].reverse_bits()),
        Fun::Unpack2x16snorm => vec![snorm(a[0]), snorm(a[0] >> 16)],
        other => panic!("{other:?} of integers is not supported"),
    }
}
