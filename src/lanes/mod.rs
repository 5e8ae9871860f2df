//! Plain loops over numbers that the compiler turns into vector instructions: the elementary functions that such
//! loops may call, and the choice of the widest instructions that the processor has.
//!
//! Every width gives the same bits: products and sums are never fused (FMA), and every width runs the same text.

mod functions;
mod wide;

pub(crate) use functions::{exp, exp_all, ln, ln_all};
#[cfg(test)]
pub(crate) use wide::at_most;
pub(crate) use wide::{Wide, least, most, widest};
