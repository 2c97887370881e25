//! What a job asks, and how a user changes it.

use std::fmt;
use std::sync::Arc;

use super::job::Job;
use crate::estimator;
use crate::event::Side;
use crate::image::Degradation;
use crate::localize::{References, frames_within, is_one_drive};
use crate::method::Method;
use crate::run::Reference;
use crate::scene::Scene;

impl Job {
    /// Takes the query's own frame from references that were picked by hand for another one: a photo says
    /// nothing about itself.
    pub fn leave_itself_out(&mut self) {
        if self.task.protocol.is_by_hand() && self.is_one_drive() {
            let others = self.chosen.frames.iter().copied();
            let others: Vec<usize> = others.filter(|frame| *frame != self.query).collect();
            if others.len() < self.chosen.frames.len() {
                self.chosen = others.into();
            }
        }
    }

    /// Whether queries and references are frames of one drive.
    pub fn is_one_drive(&self) -> bool {
        is_one_drive(self.references.as_ref(), self.queries.as_ref())
    }

    /// Goes to another query; where references are not chosen by hand, new ones are needed.
    pub fn go_to(&mut self, query: usize) {
        self.query = query;
        if !self.task.protocol.is_by_hand() {
            self.chosen = References::default();
        }
    }

    /// Frames that could be references of a query: with pose and cloud, within the radius where the
    /// query's position is known.
    pub fn candidates(&self, query: usize) -> Vec<usize> {
        let (references, queries) = (self.references.as_ref(), self.queries.as_ref());
        let is_one_drive = self.is_one_drive();
        let is_query = |frame| is_one_drive && frame == query;
        match queries.position(query) {
            Some(place) => frames_within(references, &place, self.task.reach_m(), &is_query),
            None => (0..references.frames().len())
                .filter(|&frame| !is_query(frame) && references.has_cloud(frame))
                .filter(|&frame| references.pose(frame).is_some())
                .collect(),
        }
    }

    /// Changes what is asked as these arguments of the command line would: those of remedies.
    ///
    /// # Errors
    /// A line that says which argument cannot be followed.
    pub fn change(&mut self, args: &[String]) -> Result<(), String> {
        for pair in args.chunks(2) {
            let [option, value] = pair else {
                return Err(format!("{}: a value expected", pair.concat()));
            };
            let wrong = |why: &dyn fmt::Display| format!("{option} {value}: {why}");
            match option.as_str() {
                "--set" => {
                    let params = &mut self.task.params;
                    params.assign(value).map_err(|why| wrong(&why))?;
                }
                "--radius" => {
                    self.task.protocol.radii_m = vec![value.parse().map_err(|why| wrong(&why))?];
                }
                "--method" => {
                    let method = Method::called(value).map_err(|why| wrong(&why))?;
                    let methods = &mut self.task.protocol.methods;
                    if !methods.contains(&method) {
                        methods.push(method);
                    }
                    // In the order in which they run.
                    let place = |asked: &Method| estimator::methods().position(|m| m == *asked);
                    methods.sort_by_key(|asked| place(asked).unwrap_or(usize::MAX));
                }
                "--reference" => match value.parse() {
                    Ok(way @ Reference::Chosen(_)) => {
                        self.task.protocol.references = vec![way];
                        self.chosen = References::default();
                    }
                    _ => {
                        let frame = self.references.find(value).map_err(|why| wrong(&why))?;
                        self.choose_by_hand(vec![frame]);
                    }
                },
                "--fusion" => {
                    self.task.protocol.fusions = vec![value.parse().map_err(|why| wrong(&why))?];
                }
                _ => return Err(wrong(&"no argument of a remedy")),
            }
        }
        Ok(())
    }

    /// Takes these frames as the references.
    pub fn choose_by_hand(&mut self, frames: Vec<usize>) {
        self.chosen = frames.into();
        let names = self.reference_names();
        self.task.protocol.name_references(&names);
    }

    /// Degrades the photos of the queries, in the place of any degradation before.
    pub fn degrade(&mut self, degradation: Degradation) {
        self.task.protocol.degrade = degradation;
        self.queries = self.task.protocol.degraded(&self.queries);
    }

    /// Changes the seed of every random choice, the noise of degraded photos too.
    pub fn set_seed(&mut self, seed: u64) {
        self.task.protocol.seed = seed;
        self.queries = self.task.protocol.degraded(&self.queries);
    }

    /// The scene of the queries or of the references.
    pub fn scene(&self, side: Side) -> &Arc<dyn Scene> {
        match side {
            Side::Query => &self.queries,
            Side::Reference => &self.references,
        }
    }

    /// Query and reference frames as a person tells them apart: with their scene where there are two.
    pub fn label(&self, side: Side, frame: usize) -> String {
        self.label_of(side, &self.scene(side).frames()[frame])
    }

    /// The same for a frame that is known by its name.
    pub fn label_of(&self, side: Side, name: &str) -> String {
        if self.queries.name() == self.references.name() {
            name.to_owned()
        } else {
            format!("{} {name}", self.scene(side).name())
        }
    }

    /// The name of the query.
    pub fn query_name(&self) -> &str {
        &self.queries.frames()[self.query]
    }

    /// The names of its references.
    pub fn reference_names(&self) -> Vec<String> {
        let chosen = self.chosen.frames.iter();
        chosen.map(|&frame| self.references.frames()[frame].clone()).collect()
    }

    /// The references that repeating the run has to name: those that were ranked are ranked again.
    fn named_references(&self) -> Vec<String> {
        match self.chosen.ranking {
            Some(_) => Vec::new(),
            None => self.reference_names(),
        }
    }

    /// The arguments that repeat this run. See [`Task::arguments`](super::task::Task::arguments).
    pub fn arguments(&self) -> Vec<String> {
        (self.task).arguments(self.query_name(), &self.named_references())
    }

    /// The command line that repeats this run. See [`Task::command_line`](super::task::Task::command_line).
    pub fn command_line(&self) -> String {
        (self.task).command_line(self.query_name(), &self.named_references())
    }
}
