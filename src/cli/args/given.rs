//! The options of a protocol that were given on the command line.

use clap::{ArgMatches, Args, Command, FromArgMatches};
use posescope::run::{Protocol, ProtocolError};

/// The given options of a protocol, which override another protocol.
#[derive(Clone, Debug)]
pub struct Given(ArgMatches);

impl FromArgMatches for Given {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        Ok(Self(matches.clone()))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        self.0 = matches.clone();
        Ok(())
    }
}

impl Args for Given {
    fn augment_args(command: Command) -> Command {
        Protocol::augment_args(command)
    }

    fn augment_args_for_update(command: Command) -> Command {
        Protocol::augment_args_for_update(command)
    }
}

impl Given {
    /// The given options, and `defaults` for the rest.
    pub fn over(&self, defaults: Protocol) -> Result<Protocol, ProtocolError> {
        let mut protocol = defaults;
        let updated = protocol.update_from_arg_matches(&self.0);
        updated.map_err(|error| ProtocolError::Option(error.to_string()))?;
        protocol.checked()
    }

    /// Whether the option of this field was given.
    pub fn has(&self, field: &str) -> bool {
        self.0.try_contains_id(field).unwrap_or(false)
    }
}
