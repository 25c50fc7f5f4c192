//! Who may ask what. `schema/wire.md` has the same table.

use crate::client::{
    ArchiveAsk, Ask, ErrorCode, Failed, Order, PersonAsk, ServiceAsk, TenantAsk, TenantVerb,
};
use crate::ids::TenantId;
use crate::tenancy::{Admitted, Role};

/// Who sent a message. The endpoint and the key of the connection decide it, and nothing in the
/// message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Caller {
    /// A client of an endpoint without keys: the single user of this machine, tenant `local`, who
    /// may ask everything.
    Local,
    /// A client with an admitted key.
    Keyed(Admitted),
}

impl Caller {
    /// True if the caller has one of these roles.
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

    /// Checks that the caller may ask this.
    ///
    /// - errors: the caller has another role than is needed, or the order is about more than the
    ///   caller's own tenant.
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

    /// True for operators of tenant `local`, who are the operators of the host. Operators of
    /// another tenant manage its keys, erase its people and see its quotas. They do not set its
    /// quotas, which protect the other tenants.
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

/// The refusal of a key that was never admitted, is retired, or belongs to a disabled tenant. The
/// sentence is the same for all three, because a stranger must not learn which keys exist.
pub(super) fn not_admitted() -> Failed {
    denied("your key is not admitted here; ask the operator of the service".to_owned())
}

/// The refusal of a connection that chose its own routing id. Answers are addressed to this id, and
/// another client can choose the same id later.
pub(super) fn routing_id_chosen() -> Failed {
    denied("leave the routing id of your socket unset; answers could reach another".to_owned())
}

pub(super) fn denied(message: String) -> Failed {
    Failed { code: ErrorCode::Denied, message }
}

/// Roles that may read encrypted records. A gateway speaks for its own people only, and the records
/// are of all people of the tenant.
pub(super) const SEALED: &[Role] = &[Role::Operator, Role::Auditor];
/// Roles that may read decrypted records.
pub(super) const PLAIN: &[Role] = &[Role::Operator];

/// A gateway sees what its people say. So does an operator, who helps them. An auditor sees
/// encrypted records only.
fn roles_for(ask: &Ask) -> &'static [Role] {
    match ask {
        Ask::Service(ServiceAsk::Hello) => &[Role::Gateway, Role::Operator, Role::Auditor],
        Ask::Archive(ArchiveAsk::Plain { .. }) => PLAIN,
        Ask::Archive(_) | Ask::Service(ServiceAsk::Feed) => SEALED,
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
            ServiceAsk::Hello.into(),
            Query::Known.into(),
            Ask::Person(PersonAsk::Wait { seconds: 1 }),
            Command::Done.into(),
            ServiceAsk::Feed.into(),
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
