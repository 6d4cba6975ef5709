//! Functions of numbers that belong to no room: `math.wesl`, `color.wesl`, `random.wesl`, and what the host has of them.

pub mod random;
