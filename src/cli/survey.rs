//! `posescope survey`: how well a map localises its own frames, and how far to trust poses in it.

use posescope::run::RunError;
use posescope::survey::{Found, SurveyPlan, SurveyingError};
use posescope::table::Table;

use super::args::SurveyArgs;
use super::eval::{User, resuming};
use super::failure::CliError;
use super::interrupt::Interrupt;
use super::output;
use super::terminal::Terminal;

/// Runs the command.
pub fn survey(args: &SurveyArgs, terminal: &Terminal) -> Result<(), CliError> {
    let plan = SurveyPlan::of(args.request())?;
    let queries = plan.queries();
    let bar = terminal.bar(queries as u64);
    let mut user = User { bar: bar.clone(), interrupt: Interrupt::listen() };
    let outcome = plan.run(args.resume, &mut user, &mut |already| bar.inc(already as u64));
    bar.finish_and_clear();
    match outcome {
        Err(SurveyingError::Run(RunError::Cancelled(_))) if user.interrupt.is_raised() => {
            return Err(CliError::Interrupted(format!(
                "{} of {queries} photos done; continue with: {}",
                bar.position(),
                resuming()
            )));
        }
        outcome => outcome?,
    }
    let found = plan.found()?;
    if !terminal.is_quiet {
        output::print(&words(&found, terminal.width()).trim_end())?;
    }
    Ok(())
}

/// What was found, for a terminal of this width.
fn words(found: &Found, width: Option<usize>) -> String {
    let header = [
        "method",
        "localised",
        "right poses",
        "trusted",
        "wrong poses",
        "trusted",
        "interval of position",
        "of rotation",
    ];
    let mut table = Table::new("survey", "", header);
    let mut silent = Vec::new();
    for one in &found.methods {
        let (photos, right) = one.near;
        let poses = one.poses();
        let trusted = one.after();
        let factor =
            |of: Option<f64>| of.map_or("–".to_owned(), |factor| format!("× {factor:.2}"));
        table.push([
            one.method.label(),
            format!("{right} of {photos}"),
            poses.right.to_string(),
            trusted.right_trusted.to_string(),
            poses.wrong.to_string(),
            trusted.wrong_trusted.to_string(),
            factor(one.numbers.map(|numbers| numbers.position)),
            factor(one.numbers.map(|numbers| numbers.rotation)),
        ]);
        silent.extend(one.numbers.is_none().then(|| one.method.label()));
    }
    let mut text = table.to_text(width);
    if !silent.is_empty() {
        text += &format!(
            "\n{} gave too few poses to say how far to trust them; more --queries may help.\n",
            silent.join(" and ")
        );
    }
    text += &format!("\nThe map: {}\n", found.page.display());
    text += &match &found.kept {
        Some(_) => format!(
            "run, view and eval follow this survey from now on in {}; --survey none leaves it out.\n",
            found.file.scene
        ),
        None => "There is no cache directory; name the survey with --survey.\n".to_owned(),
    };
    text
}
