//! An order of the free nodes that keeps neighbours close: reverse Cuthill and McKee (A. George, J. W. Liu, Computer
//! Solution of Large Sparse Positive Definite Systems, 1981, chapter 4).

use std::collections::VecDeque;

/// The nodes in their new order, those of `last` at the end of it; `neighbours` of each node, itself left out.
pub fn reverse_cuthill_mckee(neighbours: &[Vec<usize>], last: &[usize]) -> Vec<usize> {
    let n = neighbours.len();
    let mut placed = vec![false; n];
    let mut order = Vec::with_capacity(n);
    let mut begin = last.to_vec();
    while let Some(any) = (0..n).filter(|&i| !placed[i]).min_by_key(|&i| neighbours[i].len()) {
        if begin.is_empty() {
            begin.push(far_end(neighbours, any));
        }
        let mut queue = VecDeque::from(std::mem::take(&mut begin));
        queue.iter().for_each(|&k| placed[k] = true);
        while let Some(node) = queue.pop_front() {
            order.push(node);
            let mut next: Vec<usize> = neighbours[node].iter().copied().filter(|&k| !placed[k]).collect();
            next.sort_by_key(|&k| (neighbours[k].len(), k));
            for k in next {
                placed[k] = true;
                queue.push_back(k);
            }
        }
    }
    order.reverse();
    order
}

/// A node at the end of one of the longest ways through the graph, as far as repeated searches from the farthest node
/// find one.
fn far_end(neighbours: &[Vec<usize>], from: usize) -> usize {
    let (mut node, mut depth) = (from, 0);
    loop {
        let level = levels(neighbours, node);
        let deepest = level.iter().flatten().copied().max().unwrap_or(0);
        if deepest <= depth && node != from {
            return node;
        }
        let ends = (0..neighbours.len()).filter(|&i| level[i] == Some(deepest));
        let Some(next) = ends.min_by_key(|&i| neighbours[i].len()) else { return node };
        if deepest == 0 || deepest <= depth {
            return node;
        }
        (node, depth) = (next, deepest);
    }
}

/// Distance of each node from `start`; none where no way leads.
fn levels(neighbours: &[Vec<usize>], start: usize) -> Vec<Option<usize>> {
    let mut level = vec![None; neighbours.len()];
    level[start] = Some(0);
    let mut queue = VecDeque::from([(start, 0)]);
    while let Some((node, depth)) = queue.pop_front() {
        for &k in &neighbours[node] {
            if level[k].is_none() {
                level[k] = Some(depth + 1);
                queue.push_back((k, depth + 1));
            }
        }
    }
    level
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A strip of 40 by 3 nodes given by shuffled numbers has a band of about 4 afterwards; two strips are both placed.
    #[test]
    fn a_strip_is_numbered_along_its_length() {
        let (long, wide) = (40, 3);
        let name = |i: usize, j: usize, s: usize| (s * long * wide) + ((i * wide + j) * 77) % (long * wide);
        let mut neighbours = vec![Vec::new(); 2 * long * wide];
        for s in 0..2 {
            for i in 0..long {
                for j in 0..wide {
                    for (k, l) in [(i + 1, j), (i, j + 1)].into_iter().filter(|&(k, l)| k < long && l < wide) {
                        neighbours[name(i, j, s)].push(name(k, l, s));
                        neighbours[name(k, l, s)].push(name(i, j, s));
                    }
                }
            }
        }
        let order = reverse_cuthill_mckee(&neighbours, &[]);
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert!(sorted.iter().enumerate().all(|(i, &k)| i == k));
        let mut place = vec![0; order.len()];
        order.iter().enumerate().for_each(|(i, &k)| place[k] = i);
        let band = (0..order.len()).flat_map(|i| neighbours[i].iter().map(move |&k| (i, k)));
        let band = band.map(|(i, k)| place[i].abs_diff(place[k])).max().unwrap();
        assert!(band <= 5, "{band}");
        // A line of nodes across the one strip comes last, and the band is hardly wider.
        let line: Vec<usize> = (0..wide).map(|j| name(0, j, 0)).collect();
        let order = reverse_cuthill_mckee(&neighbours, &line);
        assert!(order[order.len() - wide..].iter().all(|k| line.contains(k)), "{order:?}");
        order.iter().enumerate().for_each(|(i, &k)| place[k] = i);
        let band = (0..order.len()).flat_map(|i| neighbours[i].iter().map(move |&k| (i, k)));
        let band = band.map(|(i, k)| place[i].abs_diff(place[k])).max().unwrap();
        assert!(band <= 5, "{band}");
    }
}
