//! Paths between poses around obstacles, through intermediate poses with clear straight motions.
//!
//! Method: a probabilistic roadmap (Kavraki et al. 1996) over the candidates, which are random and collision-free; each is
//! connected to the nearest ones with a clear straight motion. Poses of a connected part can be visited in any order; all others
//! are excluded from the choice.
//! Departures: the distance is dominated by the first three joints, since the wrist seldom causes collisions; a path is
//! shortened where a straight motion is clear.

use super::keep_out::CollisionChecker;
use truegrind_arm::model::Joints;

/// Most neighbours that each node is connected to.
const MAX_NEIGHBOURS: usize = 12;

/// Weight of a wrist joint in the distance, relative to the first three joints.
const WRIST: f64 = 0.2;

/// Nodes, and the clear straight motions between them.
#[derive(Debug)]
pub(super) struct Roadmap {
    nodes: Vec<Joints>,
    /// For each node its neighbours, with the largest rotation of a joint (rad).
    edges: Vec<Vec<(usize, f64)>>,
}

impl Roadmap {
    /// Connects nodes with clear straight motions.
    pub(super) fn between(nodes: Vec<Joints>, checker: &CollisionChecker<'_>) -> Self {
        let mut edges: Vec<Vec<(usize, f64)>> = vec![Vec::new(); nodes.len()];
        for (i, from) in nodes.iter().enumerate() {
            let mut near: Vec<(usize, f64)> =
                (0..nodes.len()).filter(|&j| j != i).map(|j| (j, apart(from, &nodes[j]))).collect();
            near.sort_by(|a, b| a.1.total_cmp(&b.1));
            near.truncate(MAX_NEIGHBOURS);
            for (j, _) in near {
                let known = edges[i].iter().any(|(other, _)| *other == j);
                if !known && checker.motion_is_clear(from, &nodes[j]) {
                    let turn = (from - nodes[j]).amax();
                    edges[i].push((j, turn));
                    edges[j].push((i, turn));
                }
            }
        }
        Self { nodes, edges }
    }

    /// The nodes of the largest connected part, in ascending order.
    pub(super) fn largest(&self) -> Vec<usize> {
        let mut part: Vec<Option<usize>> = vec![None; self.nodes.len()];
        let mut best: Vec<usize> = Vec::new();
        for start in 0..self.nodes.len() {
            if part[start].is_some() {
                continue;
            }
            part[start] = Some(start);
            let (mut members, mut at) = (vec![start], 0);
            while let Some(node) = members.get(at).copied() {
                at += 1;
                for (next, _) in &self.edges[node] {
                    if part[*next].is_none() {
                        part[*next] = Some(start);
                        members.push(*next);
                    }
                }
            }
            if members.len() > best.len() {
                best = members;
            }
        }
        best.sort_unstable();
        best
    }

    /// Stops between a node and the start of the approach to another. `None` if there is no path.
    pub(super) fn waypoints(
        &self,
        checker: &CollisionChecker<'_>,
        from: &Joints,
        to: &Joints,
        approach: &Joints,
    ) -> Option<Vec<Joints>> {
        let node = |joints: &Joints| self.nodes.iter().position(|node| node == joints);
        let mut all: Vec<Joints> =
            self.shortest(node(from)?, node(to)?)?.into_iter().map(|node| self.nodes[node]).collect();
        // The motion from the pose to the start of its approach is clear.
        all.push(*approach);
        let (mut out, mut at) = (Vec::new(), 0);
        while at + 1 < all.len() {
            let next = (at + 2..all.len()).rev().find(|&next| checker.motion_is_clear(&all[at], &all[next]));
            at = next.unwrap_or(at + 1);
            out.push(all[at]);
        }
        out.pop();
        Some(out)
    }

    /// The nodes on the shortest path, both ends included (Dijkstra).
    fn shortest(&self, from: usize, to: usize) -> Option<Vec<usize>> {
        let count = self.nodes.len();
        let (mut length, mut before) = (vec![f64::INFINITY; count], vec![from; count]);
        let mut open = vec![true; count];
        length[from] = 0.0;
        loop {
            let next = (0..count).filter(|&i| open[i]).min_by(|&a, &b| length[a].total_cmp(&length[b]))?;
            if length[next].is_infinite() {
                return None;
            }
            if next == to {
                break;
            }
            open[next] = false;
            for &(other, turn) in &self.edges[next] {
                if length[next] + turn < length[other] {
                    length[other] = length[next] + turn;
                    before[other] = next;
                }
            }
        }
        let mut out = vec![to];
        while let Some(last) = out.last().copied().filter(|last| *last != from) {
            out.push(before[last]);
        }
        out.reverse();
        Some(out)
    }
}

fn apart(a: &Joints, b: &Joints) -> f64 {
    (0..6).map(|j| (a[j] - b[j]).abs() * if j < 3 { 1.0 } else { WRIST }).sum()
}
