//! Turns a list before and after it was edited into what has become of each entry: kept, changed, taken away or added.

/// What has become of an entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Step {
    /// An entry of before is one of now, changed or not.
    Keep,
    /// An entry of before is gone.
    Remove,
    /// An entry of now is new.
    Add,
}

/// Larger tables of costs are not made: entries are paired in their order, and the last ones go or come.
const MOST_CELLS: usize = 1_000_000;

/// What an entry costs that goes or comes: more than half of one that changes all over, so that it is rather changed.
const COMES_OR_GOES: f32 = 0.6;

/// The cheapest steps from `before` entries to `now` ones, in order; of equally cheap ones those that keep the most in front.
///
/// `cost` of turning an entry of before into one of now: 0 for equal ones, at most 1.
pub(super) fn steps(before: usize, now: usize, cost: impl Fn(usize, usize) -> f32) -> Vec<Step> {
    let most = before.min(now);
    let front = (0..most).take_while(|&i| cost(i, i) == 0.0).count();
    let back = (0..most - front).take_while(|&i| cost(before - 1 - i, now - 1 - i) == 0.0).count();
    let (rows, columns) = (before - front - back, now - front - back);
    let mut steps = vec![Step::Keep; front];
    if rows.saturating_mul(columns) > MOST_CELLS {
        steps.extend(vec![Step::Keep; rows.min(columns)]);
        steps.extend(vec![Step::Remove; rows.saturating_sub(columns)]);
        steps.extend(vec![Step::Add; columns.saturating_sub(rows)]);
    } else {
        steps.extend(cheapest(rows, columns, |i, j| cost(front + i, front + j)));
    }
    steps.extend(vec![Step::Keep; back]);
    steps
}

/// The cheapest steps by the costs of all the rest of both lists (Wagner and Fischer 1974, from the end).
fn cheapest(rows: usize, columns: usize, cost: impl Fn(usize, usize) -> f32) -> Vec<Step> {
    let width = columns + 1;
    let mut rest = vec![0.0f32; (rows + 1) * width];
    let mut kept = vec![0.0f32; rows * columns];
    for i in (0..=rows).rev() {
        for j in (0..=columns).rev() {
            let mut least = if i == rows && j == columns { 0.0 } else { f32::INFINITY };
            if i < rows {
                least = least.min(COMES_OR_GOES + rest[(i + 1) * width + j]);
            }
            if j < columns {
                least = least.min(COMES_OR_GOES + rest[i * width + j + 1]);
            }
            if i < rows && j < columns {
                kept[i * columns + j] = cost(i, j) + rest[(i + 1) * width + j + 1];
                least = least.min(kept[i * columns + j]);
            }
            rest[i * width + j] = least;
        }
    }
    let (mut i, mut j) = (0, 0);
    let mut steps = Vec::new();
    while i < rows || j < columns {
        let least = rest[i * width + j];
        if i < rows && j < columns && kept[i * columns + j] == least {
            steps.push(Step::Keep);
            (i, j) = (i + 1, j + 1);
        } else if i < rows && COMES_OR_GOES + rest[(i + 1) * width + j] == least {
            steps.push(Step::Remove);
            i += 1;
        } else {
            steps.push(Step::Add);
            j += 1;
        }
    }
    steps
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(before: &[f32], now: &[f32]) -> String {
        let cost = |i: usize, j: usize| (before[i] - now[j]).abs().min(1.0);
        let steps = steps(before.len(), now.len(), cost);
        let sign = |step: &Step| match step {
            Step::Keep => '=',
            Step::Remove => '-',
            Step::Add => '+',
        };
        steps.iter().map(sign).collect()
    }

    #[test]
    fn entries_become_those_that_they_are_most_like() {
        assert_eq!(of(&[1.0, 2.0, 3.0], &[1.0, 2.0, 3.0]), "===");
        // The first one moved, the second one gone; the same from the end; one new in the middle.
        assert_eq!(of(&[1.0, 2.0, 3.0], &[1.1, 3.0]), "=-=");
        assert_eq!(of(&[1.0, 2.0, 3.0], &[1.0, 2.9]), "=-=");
        assert_eq!(of(&[1.0, 3.0], &[1.1, 2.0, 3.1]), "=+=");
        assert_eq!(of(&[], &[1.0]), "+");
        assert_eq!(of(&[1.0, 2.0], &[]), "--");
        // Too unlike all that there is: changed all over rather than gone and come.
        assert_eq!(of(&[1.0], &[9.0]), "=");
    }

    /// Lists too long for all pairs are still paired: 3 000 entries, all moved, and 10 of them gone.
    #[test]
    fn long_lists_are_paired_in_order() {
        let before: Vec<f32> = (0..3000).map(|i| i as f32).collect();
        let now: Vec<f32> = before[..2990].iter().map(|x| x + 0.25).collect();
        assert_eq!(of(&before, &now), "=".repeat(2990) + &"-".repeat(10));
    }
}
