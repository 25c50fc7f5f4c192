//! Orders about tenants, to a running service or a closed data directory.

use apprentice::client::{Order, TenantView, read_public, show_key};
use apprentice::ids::{PublicKey, TenantId};
use apprentice::tenancy::{Quotas, Role};
use clap::{Args, Subcommand};

use super::admin_client::{AdminClient, Place};
use super::failure::Failure;
use super::log::utc;
use super::overlap;
use super::shown;

/// Manage the labs that a service serves, their keys and their quotas.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples, before the service first starts and while it runs:
  apprentice tenant add lab-a --data labs
  apprentice tenant admit lab-a a.key.pub --role gateway --label 'robot in room 7' --data labs
  apprentice tenant list --connect ipc:///run/apprentice/operator
  apprentice tenant rotate-key lab-a a.key.pub new.key.pub --overlap 7d \\
      --connect tcp://robot.example:7117 --key operator.key --server-key server.pub
  apprentice tenant quotas lab-a --utterances-per-second 20 --connect ipc:///run/apprentice/operator

Operators of tenant `local` may do all of this, and so may clients of an endpoint without keys. An
operator of another tenant may list that tenant and admit, retire and rotate its keys. You can safely
repeat an order.

Exit codes: 0 done; 1 the order was refused or not answered; 2 an argument or a directory cannot be
used.")]
pub struct Arguments {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Debug, Subcommand)]
enum Verb {
    /// Add a tenant. It gets its own secret.
    Add {
        tenant: String,
        #[command(flatten)]
        place: Place,
    },
    /// List tenants with their keys and quotas.
    List {
        /// List only this tenant.
        tenant: Option<String>,
        #[command(flatten)]
        place: Place,
    },
    /// Block a tenant. Its open connections are refused at their next message.
    Disable {
        tenant: String,
        /// The reason, for operators. Clients do not see it.
        #[arg(long, value_name = "TEXT", default_value = "")]
        reason: String,
        #[command(flatten)]
        place: Place,
    },
    /// Unblock a disabled tenant.
    Enable {
        tenant: String,
        #[command(flatten)]
        place: Place,
    },
    /// Admit a key for this tenant. A key belongs to one tenant.
    Admit {
        tenant: String,
        /// The public key: 40 characters, or a file that contains them.
        #[arg(value_name = "PUBLIC|FILE", allow_hyphen_values = true)]
        public: String,
        /// gateway (user requests), operator (keys and orders) or auditor (sealed records).
        #[arg(long, value_name = "ROLE")]
        role: Role,
        /// A note for operators, for example where this key is.
        #[arg(long, value_name = "TEXT", default_value = "")]
        label: String,
        #[command(flatten)]
        place: Place,
    },
    /// Retire a key. It can never be admitted again.
    Retire {
        tenant: String,
        #[arg(value_name = "PUBLIC|FILE", allow_hyphen_values = true)]
        public: String,
        /// The key keeps working for this long: 90s, 15m, 12h, 7d; at most 30d.
        #[arg(long, value_name = "TIME", default_value = "0s", value_parser = overlap::parse)]
        overlap: u64,
        #[command(flatten)]
        place: Place,
    },
    /// Admit a new key with the role of an old key, and retire the old key later.
    RotateKey {
        tenant: String,
        #[arg(value_name = "OLD|FILE", allow_hyphen_values = true)]
        old: String,
        #[arg(value_name = "NEW|FILE", allow_hyphen_values = true)]
        new: String,
        /// Both keys work for this long: 90s, 15m, 12h, 7d; at most 30d.
        #[arg(long, value_name = "TIME", value_parser = overlap::parse)]
        overlap: u64,
        #[command(flatten)]
        place: Place,
    },
    /// Show or set quotas. If you set any quota, every quota that you leave out becomes unlimited.
    Quotas {
        tenant: String,
        #[command(flatten)]
        limits: Limits,
        #[command(flatten)]
        place: Place,
    },
}

/// If none of them is given, the quotas are shown.
#[derive(Debug, Args)]
struct Limits {
    /// Users in memory at the same time.
    #[arg(long, value_name = "N")]
    awake_users: Option<u32>,
    /// Unanswered requests.
    #[arg(long, value_name = "N")]
    in_flight: Option<u32>,
    /// Utterances per second, on average.
    #[arg(long, value_name = "N")]
    utterances_per_second: Option<u32>,
    /// Utterances in a burst, after a pause.
    #[arg(long, value_name = "N")]
    burst: Option<u32>,
    /// Sealed bytes in the log, in total.
    #[arg(long, value_name = "BYTES")]
    sealed_bytes: Option<u64>,
    /// Trainings in the queue.
    #[arg(long, value_name = "N")]
    trainings_waiting: Option<u32>,
    /// Remove all limits.
    #[arg(long, conflicts_with_all = [
        "awake_users", "in_flight", "utterances_per_second", "burst", "sealed_bytes",
        "trainings_waiting",
    ])]
    none: bool,
}

impl Limits {
    /// - returns: none, when they are only to be shown.
    fn wanted(&self) -> Option<Quotas> {
        let quotas = Quotas {
            awake_users: self.awake_users,
            in_flight: self.in_flight,
            utterances_per_second: self.utterances_per_second,
            burst: self.burst,
            sealed_bytes: self.sealed_bytes,
            trainings_waiting: self.trainings_waiting,
        };
        (self.none || quotas != Quotas::default()).then_some(quotas)
    }
}

pub fn run(arguments: Arguments) -> Result<(), Failure> {
    let (tenant, place, order) = match arguments.verb {
        Verb::List { tenant, place } => {
            let tenant = tenant.as_deref().map(name).transpose()?;
            return list(&mut place.enter(false)?, tenant);
        }
        Verb::Quotas { tenant, limits, place } => match limits.wanted() {
            None => return show_quotas(&mut place.enter(false)?, name(&tenant)?),
            Some(quotas) => (tenant, place, Order::SetQuotas(quotas)),
        },
        Verb::Add { tenant, place } => (tenant, place, Order::Add),
        Verb::Disable { tenant, reason, place } => (tenant, place, Order::Disable { reason }),
        Verb::Enable { tenant, place } => (tenant, place, Order::Enable),
        Verb::Admit { tenant, public, role, label, place } => {
            (tenant, place, Order::Admit { key: key(&public)?, role, label })
        }
        Verb::Retire { tenant, public, overlap, place } => {
            let order = Order::Retire { key: key(&public)?, overlap_seconds: overlap };
            (tenant, place, order)
        }
        Verb::RotateKey { tenant, old, new, overlap, place } => {
            let (old, new) = (key(&old)?, key(&new)?);
            (tenant, place, Order::Rotate { old, new, overlap_seconds: overlap })
        }
    };
    let tenant = name(&tenant)?;
    let mut admin_client = place.enter(order == Order::Add)?;
    let retired = match &order {
        Order::Retire { key, .. } => Some(*key),
        _ => None,
    };
    let said = match (admin_client.obey(&tenant, order)?, retired) {
        (0, Some(key)) => as_retired(&mut admin_client, &tenant, &key),
        (0, None) => "nothing changed; this was already done".to_owned(),
        _ => "done".to_owned(),
    };
    println!("tenant {tenant}: {said}");
    Ok(())
}

/// Why an order to retire a key led to no record.
fn as_retired(admin_client: &mut AdminClient, tenant: &TenantId, key: &PublicKey) -> String {
    // None of it, when an operator has retired their own key and may not ask any more.
    let tenants = admin_client.list(Some(tenant)).unwrap_or_default();
    let known = tenants.iter().flat_map(|view| &view.keys).find(|known| known.key == *key);
    let retired_before = match known.map(|known| (known.retired, known.valid_until)) {
        Some((true, _)) => "the key is already retired and cannot be admitted again".to_owned(),
        Some((false, Some(until))) => format!(
            "the key is already retired and works until {}, which is not later than you asked for",
            utc(until)
        ),
        Some((false, None)) | None => "the key is already retired".to_owned(),
    };
    format!("nothing changed; {retired_before}")
}

fn name(text: &str) -> Result<TenantId, Failure> {
    TenantId::new(text).map_err(Failure::bad_input)
}

fn key(text: &str) -> Result<PublicKey, Failure> {
    read_public(text).map_err(Failure::bad_input)
}

fn list(admin_client: &mut AdminClient, only: Option<TenantId>) -> Result<(), Failure> {
    let tenants = admin_client.list(only.as_ref())?;
    match (&only, tenants.is_empty()) {
        (Some(tenant), true) => return Err(absent(tenant)),
        (None, true) => {
            eprintln!("apprentice: there are no tenants yet; `apprentice tenant add` makes one")
        }
        (_, false) => {}
    }
    tenants.iter().for_each(show);
    Ok(())
}

fn absent(tenant: &TenantId) -> Failure {
    Failure::failed(format!(
        "there is no tenant {tenant}; `apprentice tenant list` shows the tenants"
    ))
}

fn show(view: &TenantView) {
    let TenantView { tenant, disabled, quotas, keys } = view;
    match disabled {
        None => println!("{tenant}: {quotas}"),
        Some(reason) => {
            print!("{}", shown::lines([format!("{tenant}: DISABLED ({reason:?}); {quotas}")]));
        }
    }
    for known in keys {
        let until = match (known.retired, known.valid_until) {
            (_, None) => String::new(),
            // A jump of the clock may have ended the overlap earlier.
            (true, Some(until)) => format!(" until {} at most, retired", utc(until)),
            (false, Some(until)) => format!(" until {}, then retired", utc(until)),
        };
        let (key, role, label) = (show_key(&known.key), known.role, &known.label);
        let since = utc(known.admitted_at);
        let line = format!("  {role:<8}  {key}  since {since}{until}  {label:?}");
        print!("{}", shown::lines([line]));
    }
}

fn show_quotas(admin_client: &mut AdminClient, tenant: TenantId) -> Result<(), Failure> {
    match admin_client.list(Some(&tenant))?.first() {
        Some(view) => println!("{tenant}: {}", view.quotas),
        None => return Err(absent(&tenant)),
    }
    Ok(())
}
