//! Tasks in the order of a graph, on all free threads.
//!
//! A task is the visit of a block in a phase. It waits for the visits of conflicting blocks of smaller color in its phase, and for those of
//! all conflicting blocks in the phase before. So the order of any two visits that could see each other is fixed beforehand,
//! and the mesh is the same for any number of threads.

use std::collections::BinaryHeap;
use std::ops::Range;
use std::sync::{Condvar, Mutex, PoisonError};
use std::time::Instant;

use super::partition::KdPartition;
use tetdb_base::storage::{check_cancelled, in_place_scope, shared_tasks};

/// The graph of all visits in some phases; with `n` blocks, those in the k-th of them are tasks `k * n` and on.
pub(super) struct Graph {
    n_blocks: usize,
    first_phase: usize,
    /// Tasks that wait for each task.
    followers: Vec<Vec<u32>>,
    /// Tasks that each task waits for.
    n_before: Vec<u32>,
    /// Of two tasks that are ready, the one with the greater number goes first. It is the longest chain that begins
    /// with the task, in units of load.
    urgency: Vec<u64>,
}

impl Graph {
    /// Phases one after the other, each with the margin in its place of `MARGINS`.
    pub fn new(partition: &KdPartition, phases: Range<usize>) -> Self {
        let n = partition.blocks.len();
        let n_phases = phases.len();
        let mut followers = vec![Vec::new(); n * n_phases];
        let mut n_before = vec![0; n * n_phases];
        let mut add = |before: usize, after: usize| {
            followers[before].push(after as u32);
            n_before[after] += 1;
        };
        for (phase, margin) in phases.clone().enumerate() {
            for (b, block) in partition.blocks.iter().enumerate() {
                let color = |c: u32| partition.blocks[c as usize].color;
                for &c in &block.conflicts[margin] {
                    if color(c) < block.color {
                        add(phase * n + c as usize, phase * n + b);
                    }
                }
                if phase > 0 {
                    add((phase - 1) * n + b, phase * n + b);
                    // The margin before was the wider one.
                    for &c in &block.conflicts[margin - 1] {
                        add((phase - 1) * n + c as usize, phase * n + b);
                    }
                }
            }
        }
        let (first_phase, urgency) = (phases.start, Vec::new());
        let mut graph = Self { n_blocks: n, first_phase, followers, n_before, urgency };
        graph.find_urgency(partition, n_phases);
        graph
    }

    fn find_urgency(&mut self, partition: &KdPartition, n_phases: usize) {
        let n = self.n_blocks;
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by_key(|&b| partition.blocks[b].color);
        self.urgency = vec![0; n * n_phases];
        for phase in (0..n_phases).rev() {
            for &b in order.iter().rev() {
                let task = phase * n + b;
                let later = self.followers[task].iter().map(|&f| self.urgency[f as usize]);
                self.urgency[task] = later.max().unwrap_or(0) + partition.blocks[b].load as u64 + 1;
            }
        }
    }

    /// From now on tasks go along the tree, as far as their order allows: those near each other need the same bricks. This suits bricks
    /// that do not all stay in memory; chains are longer, and the mesh is the same.
    pub fn go_along_the_tree(&mut self) {
        let n = self.n_blocks;
        for (task, urgency) in self.urgency.iter_mut().enumerate() {
            *urgency = (n - task % n) as u64;
        }
    }

    pub fn n_tasks(&self) -> usize {
        self.followers.len()
    }

    /// Phase and block of a task.
    pub fn visit(&self, task: usize) -> (usize, usize) {
        (self.first_phase + task / self.n_blocks, task % self.n_blocks)
    }

    /// Does all tasks on some threads. Each thread has a scratch of its own, made by `scratch`. A panic, or a request to stop, ends all of them. `told`
    /// is called between tasks, on the caller's thread.
    pub fn run<S>(
        &self,
        threads: usize,
        scratch: &(dyn Fn() -> S + Sync),
        work: &(dyn Fn(&mut S, usize) + Sync),
        told: &mut dyn FnMut(),
    ) {
        shared_tasks(|| self.run_all(threads.min(self.n_blocks), scratch, work, told));
    }

    /// Returns the seconds of all tasks and of the longest chain.
    fn run_all<S>(
        &self,
        n_threads: usize,
        scratch: &(dyn Fn() -> S + Sync),
        work: &(dyn Fn(&mut S, usize) + Sync),
        told: &mut dyn FnMut(),
    ) -> [f64; 2] {
        let ready = (0..self.n_tasks()).filter(|&t| self.n_before[t] == 0);
        let state = TaskState {
            before: self.n_before.clone(),
            ready: ready.map(|t| self.rank(t)).collect(),
            done: 0,
            is_over: false,
            chains: vec![0.0; self.n_tasks()],
            seconds: [0.0; 2],
        };
        let queue = Queue { graph: self, state: Mutex::new(state), changed: Condvar::new() };
        let thread = |told: &mut dyn FnMut()| {
            let _end = EndOnUnwind(&queue);
            let mut own = scratch();
            while let Some(task) = queue.next() {
                check_cancelled();
                let begun = Instant::now();
                work(&mut own, task);
                queue.finish(task, begun.elapsed().as_secs_f64());
                told();
            }
        };
        if n_threads <= 1 {
            thread(told);
        } else {
            in_place_scope(|scope| {
                for _ in 1..n_threads {
                    scope.spawn(|_| thread(&mut || ()));
                }
                thread(told);
            });
        }
        queue.state.into_inner().unwrap_or_else(PoisonError::into_inner).seconds
    }

    fn rank(&self, task: usize) -> (u64, std::cmp::Reverse<usize>) {
        (self.urgency[task], std::cmp::Reverse(task))
    }
}

struct TaskState {
    before: Vec<u32>,
    /// Tasks to do, the most urgent first.
    ready: BinaryHeap<(u64, std::cmp::Reverse<usize>)>,
    done: usize,
    /// A thread unwinds.
    is_over: bool,
    /// Seconds of the longest chain of tasks that ends where the task begins.
    chains: Vec<f64>,
    /// Of all tasks, and of the longest chain.
    seconds: [f64; 2],
}

struct Queue<'a> {
    graph: &'a Graph,
    state: Mutex<TaskState>,
    changed: Condvar,
}

impl Queue<'_> {
    /// The next task, when there is one to do; `None` when all are done or a thread unwinds.
    fn next(&self) -> Option<usize> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        loop {
            if state.is_over || state.done == self.graph.n_tasks() {
                return None;
            }
            if let Some((_, task)) = state.ready.pop() {
                return Some(task.0);
            }
            state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }

    fn finish(&self, task: usize, seconds: f64) {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        state.done += 1;
        let end = state.chains[task] + seconds;
        let [sum, longest] = state.seconds;
        state.seconds = [sum + seconds, longest.max(end)];
        for &follower in &self.graph.followers[task] {
            let chain = &mut state.chains[follower as usize];
            *chain = chain.max(end);
            let before = &mut state.before[follower as usize];
            *before -= 1;
            if *before == 0 {
                state.ready.push(self.graph.rank(follower as usize));
            }
        }
        drop(state);
        self.changed.notify_all();
    }
}

/// Ends the others when its thread unwinds.
struct EndOnUnwind<'a, 'b>(&'a Queue<'b>);

impl Drop for EndOnUnwind<'_, '_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            let queue = self.0;
            queue.state.lock().unwrap_or_else(PoisonError::into_inner).is_over = true;
            queue.changed.notify_all();
        }
    }
}
