//! A pairwise cover of factors: every pair of levels of two factors stands in some cell (greedy, after Cohen et al.
//! 1997, without chance).

use std::collections::BTreeSet;

/// Cells as levels by factor, for factors with so many levels; `may` says which cells there can be.
pub fn pairwise(levels: &[usize], may: impl Fn(&[usize]) -> bool) -> Vec<Vec<usize>> {
    let all: Vec<Vec<usize>> = every(levels).into_iter().filter(|cell| may(cell)).collect();
    let mut open: BTreeSet<(usize, usize, usize, usize)> =
        all.iter().flat_map(|c| pairs(c)).collect();
    let mut cells: Vec<Vec<usize>> = Vec::new();
    let mut used: Vec<Vec<usize>> = levels.iter().map(|&n| vec![0; n]).collect();
    while !open.is_empty() {
        // among the cells that cover most, the one whose levels were used least
        let rank = |cell: &&Vec<usize>| {
            let covers = pairs(cell).filter(|p| open.contains(p)).count();
            let worn: usize = cell.iter().enumerate().map(|(f, &l)| used[f][l]).sum();
            (covers, usize::MAX - worn)
        };
        let Some(best) = all.iter().max_by_key(rank) else {
            break;
        };
        for pair in pairs(best) {
            open.remove(&pair);
        }
        for (factor, &level) in best.iter().enumerate() {
            used[factor][level] += 1;
        }
        cells.push(best.clone());
    }
    cells
}

fn every(levels: &[usize]) -> Vec<Vec<usize>> {
    levels.iter().fold(vec![Vec::new()], |cells, &n| {
        let longer = |cell: &Vec<usize>| {
            let cell = cell.clone();
            (0..n).map(move |l| [cell.as_slice(), &[l]].concat())
        };
        cells.iter().flat_map(longer).collect()
    })
}

fn pairs(cell: &[usize]) -> impl Iterator<Item = (usize, usize, usize, usize)> + '_ {
    (0..cell.len()).flat_map(move |f| (f + 1..cell.len()).map(move |g| (f, cell[f], g, cell[g])))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pair_that_can_be_stands_in_a_cell() {
        let levels = [3, 4, 2, 5];
        let may = |cell: &[usize]| !(cell[0] == 2 && cell[3] == 4);
        let cells = pairwise(&levels, may);
        let covered: BTreeSet<_> = cells.iter().flat_map(|c| pairs(c)).collect();
        let can: BTreeSet<_> = every(&levels).into_iter().filter(|c| may(c)).collect();
        assert!(
            can.iter()
                .flat_map(|c| pairs(c))
                .all(|p| covered.contains(&p))
        );
        assert!(
            cells.iter().all(|c| may(c)) && cells.len() < 28,
            "{}",
            cells.len()
        );
    }
}
