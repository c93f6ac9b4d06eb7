//! A binary tree of sums: draws an index with a probability in proportion to its value, and changes
//! a value, both in logarithmic time.

/// Values at the leaves, and in each inner node the sum of the two below it.
#[derive(Debug, Clone, PartialEq)]
pub struct SumTree {
    /// Number of leaves, a power of two.
    leaves: usize,
    /// Node 1 is the root; the children of node `n` are `2n` and `2n + 1`.
    nodes: Vec<f64>,
}

impl SumTree {
    /// A tree of `values` values, all 0.
    pub fn new(values: usize) -> SumTree {
        let leaves = values.next_power_of_two();
        SumTree { leaves, nodes: vec![0.0; 2 * leaves] }
    }

    /// Sum of all values.
    pub fn total(&self) -> f64 {
        self.nodes[1]
    }

    pub fn get(&self, index: usize) -> f64 {
        self.nodes[self.leaves + index]
    }

    /// Sets a value, at least 0.
    pub fn set(&mut self, index: usize, value: f64) {
        assert!(value >= 0.0 && value.is_finite(), "a priority is finite and not negative");
        let mut node = self.leaves + index;
        self.nodes[node] = value;
        // Sums are made anew rather than corrected, so that no rounding error can gather.
        while node > 1 {
            node /= 2;
            self.nodes[node] = self.nodes[2 * node] + self.nodes[2 * node + 1];
        }
    }

    /// The index at which the running sum of the values first exceeds `mass`, which is in
    /// `[0, total)`. Never one whose value is 0, unless all are.
    pub fn find(&self, mass: f64) -> usize {
        let (mut node, mut mass) = (1, mass);
        while node < self.leaves {
            let (left, right) = (self.nodes[2 * node], self.nodes[2 * node + 1]);
            // Rounding may leave a mass that the right side does not have.
            if mass < left || right == 0.0 {
                node *= 2;
            } else {
                mass -= left;
                node = 2 * node + 1;
            }
        }
        node - self.leaves
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        // Whole numbers, so that the naive sum is exact too.
        #[test]
        fn it_equals_a_naive_twin(
            length in 1_usize..40,
            writes in proptest::collection::vec((0_usize..40, 0_u32..50), 1..80),
            share in 0.0_f64..1.0,
        ) {
            let (mut tree, mut naive) = (SumTree::new(length), vec![0.0; length]);
            for (index, value) in writes {
                tree.set(index % length, f64::from(value));
                naive[index % length] = f64::from(value);
                let total: f64 = naive.iter().sum();
                prop_assert_eq!(tree.total(), total);
                if total > 0.0 {
                    let mass = (share * total).min(total - 0.5);
                    let mut sum = 0.0;
                    let expected = naive.iter().position(|value| { sum += value; sum > mass });
                    prop_assert_eq!(Some(tree.find(mass)), expected);
                }
            }
        }
    }
}
