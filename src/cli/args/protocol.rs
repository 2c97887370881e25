//! The arguments that say how queries are localised, whatever the command.

use std::fmt;
use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::Args;
use posescope::describe::Domain;
use posescope::diagnosis::Tolerance as Right;
use posescope::estimator;
use posescope::fusion::Fusion;
use posescope::image::Degradation;
use posescope::localize::Selection;
use posescope::method::Method;
use posescope::run::{EstimatesFile, Protocol};
use posescope::text::UnknownWord;

use super::{ConfigArgs, positive};
use crate::cli::compute::Compute;
use crate::cli::failure::CliError;

/// How queries are localised, one or thousands.
#[derive(Clone, Debug, Default, Args)]
pub struct ProtocolArgs {
    /// The format of the scenes, if their content does not tell
    #[arg(long, value_name = "NAME")]
    pub format: Option<String>,
    /// How references are chosen: random:K, nearest:K, maxf:K (those with the most feature matches)
    /// or retrieve:K (those that the index of `posescope index` ranks first) of the frames around the
    /// query's known position, or of all where nobody knows it and they are chosen by looks, by one of
    /// the latter two [default: random:1; for photos of no scene without --gps: maxf:1]
    #[arg(long, value_name = "HOW")]
    pub references: Option<Selection>,
    /// How far from the query's known position references may be, where that is more than the radius
    /// [m] [default: the radius]
    #[arg(long, value_name = "METRES", value_parser = positive)]
    pub prior: Option<f64>,
    /// Rough positions of queries, around which references are sought: a table with the columns `name x
    /// y z`, in the world of the scene, or `name latitude longitude`, with three frames of known pose
    /// or more among its lines
    #[arg(long, value_name = "FILE")]
    pub gps: Option<PathBuf>,
    /// The methods to run [default: fb,pm,mi,hy]
    #[arg(long, value_name = "fb,pm,mi,hy", value_delimiter = ',', value_parser = method)]
    pub method: Vec<Method>,
    /// Poses that another system found, as a method of this name beside ours; repeatable. FILE is TUM,
    /// KITTI, COLMAP's images.txt or `name qw qx qy qz x y z` as visuallocalization.net takes it
    #[arg(long, value_name = "NAME=FILE")]
    pub estimates: Vec<EstimatesFile>,
    /// Take the matches of the feature-based method from this folder, instead of finding them: hloc's
    /// features and matches (.h5), or QUERY_REFERENCE_matches.npz or .txt for each pair
    #[arg(long, value_name = "DIR")]
    pub matches: Option<PathBuf>,
    /// Degrade the photos of queries before anybody sees them, as in gamma=0.4,noise=8,invert; --help
    /// lists what there is
    #[arg(long, value_name = "STEP=STRENGTH,…", long_help = degradations())]
    pub degrade: Option<Degradation>,
    /// One pose of several references, by each of these: the poses of each averaged, or, joint, all
    /// references at once (fb, pm, mi, nid, hy) [default: none, and each reference gives its own; eval:
    /// r-wavg]
    #[arg(long, value_name = "maxf,avg,wavg,r-wavg,joint", value_delimiter = ',')]
    pub fusion: Vec<Fusion>,
    /// Seed of every random choice [default: 0]
    #[arg(long)]
    pub seed: Option<u64>,
    /// How near the truth a pose is right; another is wrong, and a verdict says why [default: 1m,5deg]
    #[arg(long, value_name = "METRES,DEGREES")]
    pub right: Option<Right>,
    /// Refuse poses of a lower confidence: the probability of being within 1 m of the truth
    #[arg(long, value_name = "PROBABILITY", value_parser = share)]
    pub accept: Option<f64>,
    /// Localise a query that went wrong again, at most so often for each result, and say what would
    /// have helped
    #[arg(long, value_name = "RUNS", num_args = 0..=1, default_missing_value = "12")]
    pub explain: Option<usize>,
    #[command(flatten)]
    pub config: ConfigArgs,
    /// Number of threads [default: one per core]; results do not depend on it
    #[arg(long, value_name = "N")]
    pub threads: Option<NonZeroUsize>,
    /// Where hypotheses of pm, mi and nid are scored; results do not depend on it
    #[arg(long, value_name = "WHERE", value_enum, default_value_t)]
    pub compute: Compute,
}

impl ProtocolArgs {
    /// What was given, and the defaults for the rest. Methods are put in the order of the registry, and
    /// behind them the other systems.
    pub fn over(&self, defaults: Protocol) -> Result<Protocol, CliError> {
        let wanted = match self.method.as_slice() {
            [] => &defaults.methods,
            wanted => wanted,
        };
        let estimates = match self.estimates.as_slice() {
            [] => defaults.estimates,
            given => given.to_vec(),
        };
        let others: Vec<Method> = estimates.iter().map(|file| file.method).collect();
        check_known(wanted, &others)?;
        if let Some(twice) = (1..others.len()).find(|&at| others[..at].contains(&others[at])) {
            let message = format!("--estimates {} is given twice", others[twice]);
            return Err(CliError::Usage(message));
        }
        let ours = estimator::methods().filter(|method| wanted.contains(method));
        Ok(Protocol {
            references: self.references.unwrap_or(defaults.references),
            prior_m: self.prior.or(defaults.prior_m),
            methods: ours.chain(others).collect(),
            fusions: match self.fusion.as_slice() {
                [] => defaults.fusions,
                wanted => wanted.to_vec(),
            },
            seed: self.seed.unwrap_or(defaults.seed),
            right: self.right.unwrap_or(defaults.right),
            accept: self.accept.or(defaults.accept),
            explain: self.explain.unwrap_or(defaults.explain),
            estimates,
            matches: self.matches.clone().or(defaults.matches),
            gps: self.gps.clone().or(defaults.gps),
            degrade: self.degrade.unwrap_or(defaults.degrade),
        })
    }
}

/// A method of ours or a name that another system may go by.
pub fn method(name: &str) -> Result<Method, String> {
    Method::called(name).map_err(|_| UnknownMethod(name).to_string())
}

/// Every method that is asked for is one of ours or goes by the name of given poses.
pub fn check_known(asked: &[Method], others: &[Method]) -> Result<(), CliError> {
    let mut asked = asked.iter();
    match asked.find(|method| estimator::find(**method).is_none() && !others.contains(method)) {
        Some(unknown) => Err(CliError::Usage(UnknownMethod(unknown.name()).to_string())),
        None => Ok(()),
    }
}

struct UnknownMethod<'a>(&'a str);

impl fmt::Display for UnknownMethod<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let known = estimator::methods().map(Method::name);
        let error = UnknownWord::among(self.0, "method", known);
        write!(f, "{error}, or a name that --estimates gives")
    }
}

/// What --degrade does, step by step.
fn degradations() -> String {
    let mut text = "Degrade the photos of queries before anybody sees them, as in gamma=0.4,noise=8,invert. \
                    References stay as they are. Whatever the order in which the steps are named, they are \
                    taken in this one:"
        .to_owned();
    for step in Degradation::default().steps() {
        let range = match step.domain {
            Domain::Flag => String::new(),
            domain => format!("={domain}"),
        };
        let unit = match step.about.unit {
            "" => String::new(),
            unit => format!(" [{unit}]"),
        };
        text += &format!("\n- {}{range}{unit}: {}", step.key, step.about.help());
    }
    text
}

pub fn share(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|share: &f64| *share > 0.0 && *share <= 1.0)
        .ok_or_else(|| "a number above 0 and up to 1 expected".to_owned())
}
