from dynamixel_emulator.commands import main

raise SystemExit(main())
