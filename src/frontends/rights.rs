//! Who may ask what. The table stands in `schema/wire.md` too.

use crate::client::{
    ArchiveAsk, Ask, DoorAsk, ErrorCode, Failed, Order, PersonAsk, TenantAsk, TenantVerb,
};
use crate::ids::TenantId;
use crate::tenancy::{Admitted, Role};

/// Who a message is from, as its door vouches: nothing in the message has a say in it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Caller {
    /// Whoever reaches a door without keys: the single user of this machine, who is tenant `local`
    /// and may do everything.
    Local,
    Keyed(Admitted),
}

impl Caller {
    /// Whether one of these roles is the caller's.
    pub fn is_one_of(&self, roles: &[Role]) -> bool {
        match self {
            Caller::Local => true,
            Caller::Keyed(admitted) => roles.contains(&admitted.role),
        }
    }

    pub fn tenant(&self) -> TenantId {
        match self {
            Caller::Local => TenantId::local(),
            Caller::Keyed(admitted) => admitted.tenant.clone(),
        }
    }

    /// - errors: the role that is needed, when the caller's is another one; an order about more
    ///   than the caller's own.
    pub fn may(&self, ask: &Ask) -> Result<(), Failed> {
        let Caller::Keyed(Admitted { role: held, .. }) = self else { return Ok(()) };
        let needed = roles_for(ask);
        if !needed.contains(held) {
            let needed: Vec<&str> = needed.iter().map(|role| role.name()).collect();
            let needed = needed.join(" or ");
            let message = format!("this needs a key with the role {needed}; yours is {held}");
            return Err(denied(message));
        }
        match ask {
            Ask::Order(order) => self.may_order(order),
            _ => Ok(()),
        }
    }

    /// The operators of the whole host are those of tenant `local`; another tenant's decide about
    /// its keys, erase its people and see its quotas. They do not set them: quotas protect the others from it.
    pub fn is_host(&self) -> bool {
        self.tenant() == TenantId::local()
    }

    fn may_order(&self, TenantAsk { tenant, verb }: &TenantAsk) -> Result<(), Failed> {
        if self.is_host() {
            return Ok(());
        }
        if tenant.as_ref().is_some_and(|tenant| *tenant != self.tenant()) {
            let host = "an order about another tenant needs an operator's key of tenant local";
            return Err(denied(host.to_owned()));
        }
        match verb {
            TenantVerb::List
            | TenantVerb::Erase { .. }
            | TenantVerb::Give(Order::Admit { .. } | Order::Retire { .. } | Order::Rotate { .. }) => {
                Ok(())
            }
            TenantVerb::Give(_) => {
                Err(denied("this order needs an operator's key of tenant local".to_owned()))
            }
        }
    }
}

/// A key that was never admitted, is retired, or belongs to a tenant that is disabled. Which of
/// them is the operator's business: the sentence says the same for all.
pub(super) fn not_admitted() -> Failed {
    denied("your key is not admitted here; ask whoever runs the service".to_owned())
}

/// A connection that chose its own routing id. Answers are addressed by it, and a chosen one can be
/// taken by somebody else as soon as its owner is gone.
pub(super) fn routing_id_chosen() -> Failed {
    denied("leave the routing id of your socket unset; answers could reach another".to_owned())
}

pub(super) fn denied(message: String) -> Failed {
    Failed { code: ErrorCode::Denied, message }
}

/// Who may have sealed records. A gateway may not: it vouches for its own people only, and records
/// are of all.
pub(super) const SEALED: &[Role] = &[Role::Operator, Role::Auditor];
/// Who may have records in the clear.
pub(super) const PLAIN: &[Role] = &[Role::Operator];

/// People's words are for their gateway and, for help, their operator; an auditor sees sealed
/// records only.
fn roles_for(ask: &Ask) -> &'static [Role] {
    match ask {
        Ask::Door(DoorAsk::Hello) => &[Role::Gateway, Role::Operator, Role::Auditor],
        Ask::Archive(ArchiveAsk::Plain { .. }) => PLAIN,
        Ask::Archive(_) | Ask::Door(DoorAsk::Feed) => SEALED,
        Ask::Person(PersonAsk::Query(_) | PersonAsk::Wait { .. }) => {
            &[Role::Gateway, Role::Operator]
        }
        Ask::Person(PersonAsk::Command(_)) => &[Role::Gateway],
        Ask::Order(_) => &[Role::Operator],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::client::Command;
    use crate::client::Query;
    use crate::ids::{PublicKey, Seq, StreamKey, UserId};
    use crate::tenancy::Quotas;

    #[test]
    fn each_role_may_ask_what_is_its_own_and_is_told_whose_the_rest_is() {
        let tenant = TenantId::new("lab").unwrap();
        let keyed = |role| Caller::Keyed(Admitted { tenant: tenant.clone(), role });
        let asks = [
            DoorAsk::Hello.into(),
            Query::Known.into(),
            Ask::Person(PersonAsk::Wait { seconds: 1 }),
            Command::Done.into(),
            DoorAsk::Feed.into(),
            Ask::Archive(ArchiveAsk::Heads { after: None, limit: 1 }),
            Ask::Archive(ArchiveAsk::Sealed {
                stream: StreamKey::TENANT,
                from: Seq::FIRST,
                limit: 1,
            }),
            Ask::Archive(ArchiveAsk::Plain {
                stream: StreamKey::TENANT,
                from: Seq::FIRST,
                limit: 1,
            }),
        ];
        let allowed = |caller: Caller| asks.each_ref().map(|ask| caller.may(ask).is_ok());
        assert_eq!(allowed(Caller::Local), [true; 8]);
        let gateway = [true, true, true, true, false, false, false, false];
        assert_eq!(allowed(keyed(Role::Gateway)), gateway);
        let operator = [true, true, true, false, true, true, true, true];
        assert_eq!(allowed(keyed(Role::Operator)), operator);
        let auditor = [true, false, false, false, true, true, true, false];
        assert_eq!(allowed(keyed(Role::Auditor)), auditor);
        let failed = keyed(Role::Auditor).may(&Query::Look.into()).unwrap_err();
        assert_eq!(failed.code, ErrorCode::Denied);
        assert_eq!(
            failed.message,
            "this needs a key with the role gateway or operator; yours is auditor"
        );
    }
    #[test]
    fn an_operator_decides_about_the_own_tenant_and_the_hosts_about_all() {
        let [lab, other] = ["lab", "other"].map(|name| TenantId::new(name).unwrap());
        let operator = |tenant: &TenantId| {
            Caller::Keyed(Admitted { tenant: tenant.clone(), role: Role::Operator })
        };
        let key = PublicKey([1; 32]);
        let own = [
            TenantVerb::List,
            TenantVerb::Erase { user: UserId::new("ada").unwrap() },
            TenantVerb::Give(Order::Admit { key, role: Role::Auditor, label: String::new() }),
            TenantVerb::Give(Order::Retire { key, overlap_seconds: 0 }),
            TenantVerb::Give(Order::Rotate { old: key, new: key, overlap_seconds: 0 }),
        ];
        let hosts = [
            TenantVerb::Give(Order::Add),
            TenantVerb::Give(Order::Disable { reason: String::new() }),
            TenantVerb::Give(Order::Enable),
            TenantVerb::Give(Order::SetQuotas(Quotas::default())),
        ];
        let may = |caller: &Caller, tenant: Option<&TenantId>, verb: &TenantVerb| {
            let ask = TenantAsk { tenant: tenant.cloned(), verb: verb.clone() };
            caller.may(&Ask::Order(ask)).is_ok()
        };
        for (verb, is_own) in own.iter().map(|v| (v, true)).chain(hosts.iter().map(|v| (v, false)))
        {
            for tenant in [None, Some(&lab)] {
                assert_eq!(may(&operator(&lab), tenant, verb), is_own, "{verb:?}");
            }
            assert!(!may(&operator(&lab), Some(&other), verb), "{verb:?}");
            for host in [Caller::Local, operator(&TenantId::local())] {
                assert!(may(&host, Some(&other), verb), "{verb:?}");
            }
            for role in [Role::Gateway, Role::Auditor] {
                for tenant in [&lab, &TenantId::local()] {
                    let caller = Caller::Keyed(Admitted { tenant: tenant.clone(), role });
                    assert!(!may(&caller, Some(tenant), verb), "{verb:?}");
                }
            }
        }
    }
}
