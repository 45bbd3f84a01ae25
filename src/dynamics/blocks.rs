//! Rows of J of what reaches over several trees: a block of numbers for each.

use std::ops::Range;

use crate::model::Model;

/// The part of a row of J that belongs to one tree.
#[derive(Clone, Debug)]
pub struct Block {
    /// Index of the tree.
    pub tree: usize,
    /// Its dofs.
    pub dofs: Range<usize>,
    /// Where its numbers begin, those of one row after those of another.
    pub at: usize,
}

/// The blocks of rows that touch these trees, `rows` rows each, from `at` on, which is moved behind them.
pub fn blocks(model: &Model, trees: impl Iterator<Item = usize>, rows: usize, at: &mut usize) -> Vec<Block> {
    let mut trees: Vec<usize> = trees.collect();
    trees.sort_unstable();
    trees.dedup();
    let block = |tree: usize| {
        let (dofs, start) = (model.trees[tree].dofs.clone(), *at);
        *at += rows * dofs.len();
        Block { tree, dofs, at: start }
    };
    trees.into_iter().map(block).collect()
}
