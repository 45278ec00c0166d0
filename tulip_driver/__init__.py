"""The robot's body behind one contract: what any driver is, what guards every body, and bodies without physics."""
