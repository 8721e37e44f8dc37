"""A physics server of this process."""

import pybullet
import pytest

from workers.simulation.server import Server


def is_connected(client: int) -> bool:
    return bool(pybullet.getConnectionInfo(client)["isConnected"])


def test_two_servers_know_nothing_of_each_others_bodies():
    with Server() as one, Server() as other:
        sphere = pybullet.createCollisionShape(pybullet.GEOM_SPHERE, physicsClientId=one.client)
        pybullet.createMultiBody(1.0, sphere, physicsClientId=one.client)
        assert pybullet.getNumBodies(physicsClientId=one.client) == 1
        assert pybullet.getNumBodies(physicsClientId=other.client) == 0


def test_a_server_ends_with_its_block_however_that_ends():
    server = Server()
    client = server.client
    assert is_connected(client)
    with pytest.raises(ZeroDivisionError), server:
        _ = 1 / 0
    assert not is_connected(client)


def test_closing_twice_ends_no_other_server():
    closed = Server()
    closed.close()
    with Server() as other:
        closed.close()
        assert is_connected(other.client)
